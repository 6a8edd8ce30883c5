// Datagrams that no honest program sends.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstdint>
#include <random>
#include <string>

#include "shm/file_descriptor.hpp"
#include "tests/gateway/dds/own_domain.hpp"

namespace arbiter::test {

// To all ports on which a program of the domain may listen: noise, and RTPS with bytes changed.
inline void send_noise(const OwnDomain& domain) {
  std::mt19937 random(1);
  const shm::FileDescriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  for (int i = 0; i < 20'000; ++i) {
    std::string datagram(random() % 200 + 4, '\0');
    for (char& byte : datagram) byte = static_cast<char>(random());
    if (i % 2 == 0) {  // a header, and submessages of known kinds
      datagram.replace(0, 4, "RTPS");
      datagram.resize(std::max<std::size_t>(datagram.size(), 24));
      datagram.replace(4, 4, std::string("\2\1\1\x10", 4));
      constexpr const char kKinds[] = {0x01, 0x06, 0x07, 0x08, 0x09, 0x0e, 0x12, 0x13, 0x15, 0x16};
      datagram[20] = kKinds[random() % sizeof kKinds];
      datagram[21] = static_cast<char>(random() % 8);
      datagram[22] = static_cast<char>(random() % 2 == 0 ? datagram.size() - 24 : random());
      datagram[23] = '\0';
    }
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    // Of participants 0 to 2: discovery, then data (RTPS 2.5, 9.6.2).
    to.sin_port =
        htons(static_cast<std::uint16_t>(7400 + 250 * domain.number() + 10 + random() % 6));
    ::sendto(socket.get(), datagram.data(), datagram.size(), 0,
             reinterpret_cast<const sockaddr*>(&to), sizeof to);
  }
}

}  // namespace arbiter::test
