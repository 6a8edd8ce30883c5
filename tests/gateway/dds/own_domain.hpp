// A domain of DDS that no other test uses meanwhile, on the loopback interface.
#pragma once

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstddef>
#include <string>

#include "shm/file_descriptor.hpp"

namespace arbiter::test {

// The number of a domain of DDS, taken as long as this lives. Its ports lie below those that the
// kernel gives out by itself. Whoever has it is bound to an abstract socket: it leaves nothing
// behind.
class OwnDomain {
 public:
  OwnDomain() {
    for (unsigned tried = 0;; ++tried) {
      number_ = kFirst + (static_cast<unsigned>(::getpid()) + tried) % kCount;
      sockaddr_un name{};
      name.sun_family = AF_UNIX;
      const std::string text = "arbiter-test-dds-domain-" + std::to_string(number_);
      text.copy(name.sun_path + 1, text.size());
      lock_.reset(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
      const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + text.size());
      if (::bind(lock_.get(), reinterpret_cast<const sockaddr*>(&name), size) == 0) return;
      if (tried % kCount == kCount - 1) ::poll(nullptr, 0, 20);  // all are taken
    }
  }
  [[nodiscard]] unsigned number() const { return number_; }

 private:
  static constexpr unsigned kFirst = 50;
  static constexpr unsigned kCount = 49;
  unsigned number_ = 0;
  shm::FileDescriptor lock_;
};

inline constexpr const char* kLoopback =
    R"(<General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces>)"
    R"(<AllowMulticast>false</AllowMulticast></General><Discovery>)"
    R"(<ParticipantIndex>auto</ParticipantIndex>)"
    R"(<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>)"
    R"(<Peers><Peer address="127.0.0.1"/></Peers></Discovery>)";

}  // namespace arbiter::test
