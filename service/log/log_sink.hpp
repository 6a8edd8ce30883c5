// What every line of the log passes: nothing that somebody else has said can forge a line or steer
// a terminal, and no user can fill the log.
//
// Lines that are written on account of a client are charged to its user (LogAccount). Each user may
// cause kMaxBurst lines at once and one more every kInterval after that. What is above it is left
// out, and told in one line as soon as there is room for one. Lines of the daemon's own are never
// left out.
#pragma once

#include <spdlog/sinks/base_sink.h>
#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "logging/log_writer.hpp"
#include "service/log/event.hpp"

namespace arbiter::service {

// While it lives, what this thread logs is charged to a user. They nest; the inner one counts.
class LogAccount {
 public:
  // Of somebody who was gone before it could be asked who it was.
  static constexpr uid_t kUnknown = static_cast<uid_t>(-1);

  explicit LogAccount(uid_t user) noexcept;
  LogAccount(const LogAccount&) = delete;
  LogAccount& operator=(const LogAccount&) = delete;
  ~LogAccount();

  [[nodiscard]] static std::optional<uid_t> current() noexcept;

 private:
  std::optional<uid_t> outer_;
};

// How many lines each user may cause. Not thread-safe.
class LogShares {
 public:
  using Time = std::chrono::system_clock::time_point;
  static constexpr std::uint32_t kMaxBurst = 1000;
  static constexpr std::chrono::milliseconds kInterval{500};

  // Whether one more line of `user` may be written at `now`. A clock that is set back only delays.
  bool take(uid_t user, Time now);
  // A user of whom lines were left out since this was last said, and who has room for a line now.
  struct LeftOut {
    uid_t user;
    std::uint64_t lines;
  };
  std::optional<LeftOut> next_left_out(Time now);

 private:
  struct Share {
    std::uint32_t used = 0;  // lines; kInterval gives one back
    Time since;              // when the last one was given back
    std::uint64_t left_out = 0;
  };

  static void give_back(Share& share, Time now);

  std::map<uid_t, Share> shares_;  // those that are not full
};

class LogSink : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit LogSink(std::shared_ptr<logging::LogWriter> writer);

 private:
  void sink_it_(const spdlog::details::log_msg& message) override;
  void flush_() override {}  // the writer is always at it

  void write(spdlog::details::log_msg message, std::string_view text, const Event* event,
             std::optional<uid_t> user);

  std::shared_ptr<logging::LogWriter> writer_;
  LogShares shares_;
};

}  // namespace arbiter::service
