// A daemon, RouDi, the gateway, and programs of iceoryx that know of neither.
#pragma once

#include <gmock/gmock.h>
#include <signal.h>
#include <unistd.h>

#include <stdexcept>
#include <string>

#include <arbiter/arbiter.hpp>

#include "tests/gateway/iceoryx/private_machine.hpp"
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

inline Spoken plain_publisher(const std::string& event, int header = 0, int history = 0) {
  Spoken publisher({ARBITER_TESTS "/plain_iceoryx_publisher", "Test", "One", event,
                    std::to_string(header), std::to_string(history)});
  EXPECT_TRUE(publisher.hear("ready")) << publisher.heard;
  return publisher;
}

inline Spoken plain_subscriber(const std::string& event) {
  return Spoken({ARBITER_TESTS "/plain_iceoryx_subscriber", "Test", "One", event});
}

inline std::string write_mapping(const TemporaryDirectory& directory, const std::string& entries) {
  return directory.write("gateway.xml", "<gateway kind='iceoryx'>" + entries + "</gateway>");
}
inline Spoken gateway(const TemporaryDirectory& directory, const std::string& entries) {
  return Spoken({ARBITER_PROGRAMS "/arbiter-gateway-iceoryx", write_mapping(directory, entries)});
}

// As long as it takes, for a test has an end of its own.
template <class Condition>
void wait_until(Condition condition) {
  while (!condition()) ::usleep(5000);
}

// "High" overrides "Low"; both T are long enough for a slow machine.
inline constexpr const char* kModel =
    "<behaviors timeout='60s'>"
    "<behavior name='Low'><config at='/Base:i'>/Low:o</config></behavior>"
    "<behavior name='High'><config at='/Base:i'>/High:o</config><inhibition>Low</inhibition>"
    "</behavior></behaviors>";

inline std::string in(const std::string& event, const std::string& port,
                      const std::string& more = "") {
  return "<in service='Test' instance='One' event='" + event + "' port='" + port + "' " + more +
         "/>";
}
inline std::string out(const std::string& port, const std::string& event,
                       const std::string& more = "") {
  return "<out port='" + port + "' service='Test' instance='One' event='" + event + "' " + more +
         "/>";
}

class Iceoryx : public testing::Test {
 protected:
  void SetUp() override { ::signal(SIGPIPE, SIG_IGN); }

  std::string described(const std::string& source) {
    const auto status = daemon_.source(source);
    return status.contains("described") ? status["described"].get<std::string>() : "";
  }
  pid_t worker_of(const std::string& source) {
    return daemon_.source(source)["component"]["pid"].get<pid_t>();
  }
  void wait_for_another_worker(const std::string& source, pid_t worker) {
    wait_until([&] {
      const auto status = daemon_.source(source);
      return status["open"] == true && status["component"]["pid"] != worker;
    });
  }
  std::string described_input(const std::string& port) {
    const auto status = daemon_.input(port);
    return status.contains("described") ? status["described"].get<std::string>() : "";
  }
  void wait_for_description(const std::string& source, const std::string& text) {
    wait_until([&] { return described(source).find(text) != std::string::npos; });
  }
  // Who is subscribed to a worker need not be to the next one yet when that knows its publishers.
  void wait_for_both_ends() {
    wait_for_description("/Low:o", "1 publisher matched");
    wait_until([&] {
      return described_input("/Base:i").find("1 subscriber matched") != std::string::npos;
    });
  }
  // From a new publisher to a new subscriber.
  void expect_that_samples_pass() {
    Spoken publisher = plain_publisher("low");
    Spoken subscriber = plain_subscriber("base");
    ASSERT_TRUE(subscriber.hear("ready"));
    wait_for_description("/Low:o", "1 publisher matched");
    publisher.say("x");
    EXPECT_EQ(subscriber.line(), "|x");
  }

  EmptyMachine empty_;
  TemporaryDirectory directory_;
  Daemon daemon_{kModel};
};

}  // namespace arbiter::test
