// What the kernel does at best to wake a process by a descriptor: a pipe (which is how an input
// port is woken), an eventfd, a Unix datagram socket (which is also a peer: people send samples
// so).
#include <fcntl.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "bench/peers/spin.hpp"
#include "bench/peers/systems.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::bench {
namespace {

[[noreturn]] void fail(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

// For each direction, where to write and where to read.
struct Way {
  shm::FileDescriptor write;
  shm::FileDescriptor read;
};

struct Kind {
  const char* name;
  Role role;
  std::size_t max_bytes;
  bool may_spin;
  Way (*make)(std::size_t bytes);
};

Way make_pipe(std::size_t) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) fail("pipe");
  return {shm::FileDescriptor(ends[1]), shm::FileDescriptor(ends[0])};
}

Way make_eventfd(std::size_t) {
  shm::FileDescriptor one(::eventfd(0, EFD_CLOEXEC));
  if (!one) fail("eventfd");
  shm::FileDescriptor same(::fcntl(one.get(), F_DUPFD_CLOEXEC, 3));
  if (!same) fail("eventfd");
  return {std::move(one), std::move(same)};
}

Way make_datagram_pair(std::size_t bytes) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0, ends) != 0) fail("socketpair");
  Way way{shm::FileDescriptor(ends[0]), shm::FileDescriptor(ends[1])};
  const int size = static_cast<int>(2 * bytes + 4096);
  ::setsockopt(way.write.get(), SOL_SOCKET, SO_SNDBUF, &size, sizeof size);
  return way;
}

class DescriptorEndpoint : public Endpoint {
 public:
  DescriptorEndpoint(int out, int in, const Exchange& exchange)
      : out_(out),
        in_(in),
        spins_(exchange.waiting == Waiting::kSpinning),
        buffer_(exchange.bytes) {}

  void send(std::uint64_t number) override {
    std::memcpy(buffer_.data(), &number, sizeof number);
    if (::write(out_, buffer_.data(), buffer_.size()) < 0) fail("write");
  }
  std::uint64_t receive() override {
    if (spins_) {
      spin_until([&] { return ::recv(in_, buffer_.data(), buffer_.size(), MSG_DONTWAIT) > 0; });
    } else if (::read(in_, buffer_.data(), buffer_.size()) <= 0) {
      fail("read");
    }
    std::uint64_t number = 0;
    std::memcpy(&number, buffer_.data(), sizeof number);
    return number;
  }

 private:
  int out_;
  int in_;
  bool spins_;
  std::vector<std::byte> buffer_;
};

class DescriptorSession : public Session {
 public:
  DescriptorSession(const Kind& kind, const Exchange& exchange)
      : exchange_(exchange), ping_(kind.make(exchange.bytes)), pong_(kind.make(exchange.bytes)) {}

  std::unique_ptr<Endpoint> open(Side side) override {
    const bool initiates = side == Side::kInitiator;
    return std::make_unique<DescriptorEndpoint>((initiates ? ping_ : pong_).write.get(),
                                                (initiates ? pong_ : ping_).read.get(), exchange_);
  }

 private:
  Exchange exchange_;
  Way ping_;
  Way pong_;
};

class DescriptorSystem : public System {
 public:
  explicit DescriptorSystem(const Kind& kind) : kind_(kind) {}

  [[nodiscard]] std::string name() const override { return kind_.name; }
  [[nodiscard]] Role role() const override { return kind_.role; }
  [[nodiscard]] bool can(const Exchange& exchange) const override {
    return exchange.bytes <= kind_.max_bytes &&
           (exchange.waiting == Waiting::kBlocking || kind_.may_spin);
  }
  std::unique_ptr<Session> prepare(const Exchange& exchange) override {
    Exchange own = exchange;
    if (kind_.role == Role::kFloor) own.bytes = sizeof(std::uint64_t);
    return std::make_unique<DescriptorSession>(kind_, own);
  }

 private:
  Kind kind_;
};

}  // namespace

std::unique_ptr<System> pipe_system() {
  return std::make_unique<DescriptorSystem>(Kind{kPipe, Role::kFloor, 64, false, make_pipe});
}
std::unique_ptr<System> eventfd_system() {
  return std::make_unique<DescriptorSystem>(Kind{"eventfd", Role::kFloor, 64, false, make_eventfd});
}
std::unique_ptr<System> unix_datagram_system() {
  constexpr std::size_t kLargestDatagram = 128 * 1024;  // below the default of net.core.wmem_max
  return std::make_unique<DescriptorSystem>(
      Kind{"Unix datagram", Role::kPeer, kLargestDatagram, true, make_datagram_pair});
}

}  // namespace arbiter::bench
