// A daemon, RouDi, the gateway, and programs of iceoryx that know of neither.
#pragma once

#include <fcntl.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <unistd.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/child_process.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {

// A program whose output is read line by line.
class Spoken {
 public:
  Spoken() = default;
  explicit Spoken(std::vector<std::string> argv) {
    int in[2];
    int out[2];
    if (::pipe2(in, O_CLOEXEC) != 0 || ::pipe2(out, O_CLOEXEC) != 0)
      throw std::runtime_error("pipe");
    in_.reset(in[1]);
    out_.reset(out[0]);
    const shm::FileDescriptor their_in(in[0]);
    const shm::FileDescriptor their_out(out[1]);
    process = ChildProcess(argv, {}, {their_in.get(), their_out.get(), their_out.get()});
  }

  // The next line; nothing: it has ended, or says nothing for half a minute.
  std::optional<std::string> line() {
    for (;;) {
      if (const auto end = read_.find('\n'); end != std::string::npos) {
        std::string result = read_.substr(0, end);
        read_.erase(0, end + 1);
        return result;
      }
      pollfd polled{out_.get(), POLLIN, 0};
      if (::poll(&polled, 1, 30'000) <= 0) return {};
      char bytes[4096];
      const ssize_t count = ::read(out_.get(), bytes, sizeof bytes);
      if (count <= 0) return {};
      read_.append(bytes, static_cast<std::size_t>(count));
    }
  }
  // Reads until a line contains `text`; false: none does.
  bool hear(const std::string& text) {
    for (;;) {
      const auto next = line();
      if (!next) return false;
      if (next->find(text) != std::string::npos) return true;
      heard += *next + "\n";
    }
  }
  void say(const std::string& text) const {
    const std::string with_end = text + "\n";
    static_cast<void>(!::write(in_.get(), with_end.data(), with_end.size()));
  }

  ChildProcess process;
  std::string heard;  // lines that were passed over

 private:
  shm::FileDescriptor in_;
  shm::FileDescriptor out_;
  std::string read_;
};

class Roudi : public Spoken {
 public:
  // With memory for some chunks of each size up to 1 MiB.
  explicit Roudi(const TemporaryDirectory& directory)
      : Spoken({ARBITER_ROUDI, "-c", directory.write("roudi.toml", kConfiguration)}) {
    if (!hear("RouDi is ready")) throw std::runtime_error("no RouDi: " + heard);
  }

 private:
  static constexpr const char* kConfiguration =
      "[general]\nversion = 1\n[[segment]]\n"
      "[[segment.mempool]]\nsize = 128\ncount = 200\n"
      "[[segment.mempool]]\nsize = 4096\ncount = 100\n"
      "[[segment.mempool]]\nsize = 1049600\ncount = 16\n";
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
