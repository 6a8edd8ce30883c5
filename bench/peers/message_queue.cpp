// Boost.Interprocess's message_queue: a mutex, conditions and a heap of messages in shared memory.
#include <cstring>

#include <boost/date_time/posix_time/posix_time_types.hpp>
#include <boost/interprocess/ipc/message_queue.hpp>

#include "bench/peers/spin.hpp"
#include "bench/peers/systems.hpp"

namespace arbiter::bench {
namespace {

using boost::interprocess::message_queue;

class MessageQueueEndpoint : public Endpoint {
 public:
  MessageQueueEndpoint(const Exchange& exchange, message_queue& out, message_queue& in)
      : spins_(exchange.waiting == Waiting::kSpinning),
        out_(out),
        in_(in),
        sent_(exchange.bytes),
        received_(exchange.bytes) {}

  void send(std::uint64_t number) override {
    std::memcpy(sent_.data(), &number, sizeof number);
    out_.send(sent_.data(), sent_.size(), 0);
  }

  std::uint64_t receive() override {
    message_queue::size_type size = 0;
    unsigned priority = 0;
    if (spins_) {
      spin_until(
          [&] { return in_.try_receive(received_.data(), received_.size(), size, priority); });
    } else {
      using namespace boost::posix_time;
      const ptime deadline = microsec_clock::universal_time() + seconds(10);
      if (!in_.timed_receive(received_.data(), received_.size(), size, priority, deadline)) {
        throw BenchError("no sample has come for ten seconds");
      }
    }
    std::uint64_t number = 0;
    std::memcpy(&number, received_.data(), sizeof number);
    return number;
  }

 private:
  bool spins_;
  message_queue& out_;
  message_queue& in_;
  std::vector<std::byte> sent_;
  std::vector<std::byte> received_;
};

// Its file in /dev/shm goes as soon as it is there: the workers inherit the memory itself.
class Queue {
 public:
  Queue(const std::string& name, std::size_t bytes)
      : queue_(boost::interprocess::create_only, name.c_str(), kDepth, bytes) {
    message_queue::remove(name.c_str());
  }
  message_queue& get() { return queue_; }

 private:
  static constexpr std::size_t kDepth = 8;
  message_queue queue_;
};

class MessageQueueSession : public Session {
 public:
  explicit MessageQueueSession(const Exchange& exchange)
      : exchange_(exchange),
        ping_(exchange.unique + "-ping", exchange.bytes),
        pong_(exchange.unique + "-pong", exchange.bytes) {}

  std::unique_ptr<Endpoint> open(Side side) override {
    const bool initiates = side == Side::kInitiator;
    return std::make_unique<MessageQueueEndpoint>(exchange_, (initiates ? ping_ : pong_).get(),
                                                  (initiates ? pong_ : ping_).get());
  }

 private:
  Exchange exchange_;
  Queue ping_;
  Queue pong_;
};

class MessageQueueSystem : public System {
 public:
  [[nodiscard]] std::string name() const override { return "Boost message_queue"; }
  [[nodiscard]] Role role() const override { return Role::kPeer; }
  [[nodiscard]] bool can(const Exchange&) const override { return true; }
  std::unique_ptr<Session> prepare(const Exchange& exchange) override {
    return std::make_unique<MessageQueueSession>(exchange);
  }
};

}  // namespace

std::unique_ptr<System> message_queue_system() { return std::make_unique<MessageQueueSystem>(); }

}  // namespace arbiter::bench
