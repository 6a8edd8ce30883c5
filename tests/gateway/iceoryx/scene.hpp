// A daemon, RouDi, the gateway, and programs of iceoryx that know of neither.
#pragma once

#include <gmock/gmock.h>
#include <unistd.h>

#include <stdexcept>
#include <string>

#include "tests/support/daemon.hpp"
#include "tests/support/spoken.hpp"

namespace arbiter::test {

class Roudi : public Spoken {
 public:
  // Memory for some chunks of each size up to 1 MiB.
  static constexpr const char* kMuch =
      "[[segment.mempool]]\nsize = 128\ncount = 200\n"
      "[[segment.mempool]]\nsize = 4096\ncount = 100\n"
      "[[segment.mempool]]\nsize = 1049600\ncount = 16\n";
  // For four of at most 128 bytes.
  static constexpr const char* kLittle = "[[segment.mempool]]\nsize = 128\ncount = 4\n";

  explicit Roudi(const TemporaryDirectory& directory, const std::string& pools = kMuch)
      : Spoken({ARBITER_ROUDI, "-c",
                directory.write("roudi.toml", "[general]\nversion = 1\n[[segment]]\n" + pools)}) {
    if (!hear("RouDi is ready")) throw std::runtime_error("no RouDi: " + heard);
  }
};

inline Spoken plain_publisher(const std::string& event, int header = 0) {
  Spoken publisher(
      {ARBITER_TESTS "/plain_iceoryx_publisher", "Test", "One", event, std::to_string(header)});
  EXPECT_TRUE(publisher.hear("ready")) << publisher.heard;
  return publisher;
}

inline Spoken plain_subscriber(const std::string& event) {
  return Spoken({ARBITER_TESTS "/plain_iceoryx_subscriber", "Test", "One", event});
}

inline Spoken gateway(const TemporaryDirectory& directory, const std::string& entries) {
  const std::string mapping =
      directory.write("gateway.xml", "<gateway kind='iceoryx'>" + entries + "</gateway>");
  return Spoken({ARBITER_PROGRAMS "/arbiter-gateway-iceoryx", mapping});
}

// As long as it takes, for a test has an end of its own.
template <class Condition>
void wait_until(Condition condition) {
  while (!condition()) ::usleep(5000);
}

}  // namespace arbiter::test
