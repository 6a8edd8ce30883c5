// A call on the daemon: connect, say hello, ask, and have an answer.
//
// Nothing here starts a thread or goes on by itself. A Call speaks to one daemon, and fails where
// that one goes: what must happen once is not asked again of the next.
//
// Messages are what a person needs: which sockets were tried and what was wrong with each, which
// instances run, whom we wait for, and what the daemon refuses.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "shm/file_descriptor.hpp"
#include "wire/messages.hpp"

namespace arbiter::wire {

// No daemon, one that does not answer, or one that refuses: the message says which, and why.
class CallError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A daemon that is there, and says no.
class RefusedError : public CallError {
 public:
  using CallError::CallError;
};

// Who calls, and how long it may take.
struct Caller {
  std::string name;                         // what the hello says: "arbiter-status"
  std::string instance;                     // as instance_name() gives it
  std::uint32_t flags = 0;                  // of kHello
  std::chrono::milliseconds patience{300};  // how long a daemon is looked for
  // What a daemon that is there has to answer, at least: it may be reading a model, or taking over.
  std::chrono::milliseconds answer_time{5000};
  // Once, after so long, with whom we wait for: "arbiterd (pid 42) of instance "x" to answer".
  // Nobody hears of a shorter wait. What it throws goes through.
  std::chrono::milliseconds quiet{2000};
  std::function<void(const std::string& whom)> on_waiting{};
};

// A daemon that has let us in. Children do not inherit the socket.
struct Welcome {
  shm::FileDescriptor socket;
  Received received;      // kWelcome
  std::string directory;  // where we have met
  shm::Nanoseconds asked = 0;
};

[[nodiscard]] Message hello_of(const Caller& caller);
// "no arbiterd of instance "x" answered within 300 ms (…); start one with: …". `why_not`: what was
// wrong with each socket.
[[nodiscard]] std::string nobody_answers(const Caller& caller, const std::string& why_not);

// "process 42 has no descriptor left for …: raise RLIMIT_NOFILE (…)": of this process.
[[nodiscard]] std::string no_descriptor_left(std::string_view what_for);

// Looks for the instance's daemon and says hello. Throws CallError.
[[nodiscard]] Welcome join(const Caller& caller);

class Call {
 public:
  // As join().
  explicit Call(Caller caller);

  // The answer to the question; what else the daemon says is passed over. Without a limit it waits
  // for as long as the daemon lives. Throws CallError where it refuses, goes, or is too late.
  Received ask(Message question, std::optional<std::chrono::milliseconds> limit = {});

  // The daemon's process as a descriptor; none where it cannot be seen from here.
  [[nodiscard]] shm::FileDescriptor process() const;
  // Returns when the daemon has hung up and that process has ended.
  void wait_until_gone(const shm::FileDescriptor& process);

 private:
  bool wait_for(int descriptor, std::optional<std::chrono::milliseconds> limit, const char* what);

  const Caller caller_;
  shm::FileDescriptor socket_;
  bool has_told_ = false;  // that it waits
  std::uint64_t last_request_ = 0;
};

}  // namespace arbiter::wire
