// ZeroMQ's PAIR sockets over ipc (a Unix stream socket, and a thread at each end that serves it).
#include <zmq.h>

#include <cerrno>
#include <cstring>

#include "bench/peers/spin.hpp"
#include "bench/peers/systems.hpp"

namespace arbiter::bench {
namespace {

[[noreturn]] void fail(const char* what) {
  throw BenchError(std::string(what) + ": " + zmq_strerror(zmq_errno()));
}

class ZeromqEndpoint : public Endpoint {
 public:
  ZeromqEndpoint(const Exchange& exchange, Side side)
      : spins_(exchange.waiting == Waiting::kSpinning),
        bytes_(exchange.bytes),
        context_(zmq_ctx_new()),
        socket_(zmq_socket(context_, ZMQ_PAIR)) {
    if (socket_ == nullptr) fail("zmq_socket");
    const int patience_ms = 10'000;
    const int linger_ms = 0;
    zmq_setsockopt(socket_, ZMQ_RCVTIMEO, &patience_ms, sizeof patience_ms);
    zmq_setsockopt(socket_, ZMQ_LINGER, &linger_ms, sizeof linger_ms);
    // Linux's abstract names leave no file behind.
    const std::string address = "ipc://@" + exchange.unique;
    if (side == Side::kInitiator ? zmq_bind(socket_, address.c_str()) != 0
                                 : zmq_connect(socket_, address.c_str()) != 0) {
      fail(address.c_str());
    }
    meet();
  }
  ~ZeromqEndpoint() override {
    zmq_close(socket_);
    zmq_ctx_term(context_);
  }

  void send(std::uint64_t number) override {
    zmq_msg_t message;
    if (zmq_msg_init_size(&message, bytes_) != 0) fail("zmq_msg_init_size");
    std::memcpy(zmq_msg_data(&message), &number, sizeof number);
    if (zmq_msg_send(&message, socket_, 0) < 0) fail("zmq_msg_send");
  }

  std::uint64_t receive() override {
    zmq_msg_t message;
    zmq_msg_init(&message);
    if (spins_) {
      spin_until([&] {
        if (zmq_msg_recv(&message, socket_, ZMQ_DONTWAIT) >= 0) return true;
        if (zmq_errno() != EAGAIN) fail("zmq_msg_recv");
        return false;
      });
    } else if (zmq_msg_recv(&message, socket_, 0) < 0) {
      fail("zmq_msg_recv");
    }
    std::uint64_t number = 0;
    std::memcpy(&number, zmq_msg_data(&message), sizeof number);
    zmq_msg_close(&message);
    return number;
  }

 private:
  // A sample each way before any is measured: then both directions are connected.
  void meet() {
    send(0);
    if (receive() != 0) throw BenchError("not the other end's greeting");
  }

  bool spins_;
  std::size_t bytes_;
  void* context_;
  void* socket_;
};

class ZeromqSession : public Session {
 public:
  explicit ZeromqSession(const Exchange& exchange) : exchange_(exchange) {}
  std::unique_ptr<Endpoint> open(Side side) override {
    return std::make_unique<ZeromqEndpoint>(exchange_, side);
  }

 private:
  Exchange exchange_;
};

class ZeromqSystem : public System {
 public:
  [[nodiscard]] std::string name() const override { return "ZeroMQ ipc"; }
  [[nodiscard]] Role role() const override { return Role::kPeer; }
  [[nodiscard]] bool can(const Exchange&) const override { return true; }
  std::unique_ptr<Session> prepare(const Exchange& exchange) override {
    return std::make_unique<ZeromqSession>(exchange);
  }
};

}  // namespace

std::unique_ptr<System> zeromq_system() { return std::make_unique<ZeromqSystem>(); }

}  // namespace arbiter::bench
