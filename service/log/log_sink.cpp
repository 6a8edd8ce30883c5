#include "service/log/log_sink.hpp"

#include <utility>

#include "service/log/journal.hpp"
#include "shm/utf8.hpp"

namespace arbiter::service {
namespace {

thread_local std::optional<uid_t> charged;

std::string describe(const LogShares::LeftOut& left_out) {
  const std::string whose = left_out.user == LogAccount::kUnknown
                                ? "clients that were turned away"
                                : "clients of user " + std::to_string(left_out.user);
  return std::to_string(left_out.lines) + " lines about " + whose + " were left out: more than " +
         std::to_string(LogShares::kMaxBurst) + " at once";
}

}  // namespace

LogAccount::LogAccount(uid_t user) noexcept : outer_(std::exchange(charged, user)) {}

LogAccount::~LogAccount() { charged = outer_; }

std::optional<uid_t> LogAccount::current() noexcept { return charged; }

void LogShares::give_back(Share& share, Time now) {
  if (now < share.since) share.since = now;
  const auto intervals = (now - share.since) / kInterval;
  if (intervals >= share.used) {
    share.used = 0;
    share.since = now;
  } else {
    share.used -= static_cast<std::uint32_t>(intervals);
    share.since += intervals * kInterval;
  }
}

bool LogShares::take(uid_t user, Time now) {
  const auto [found, is_new] = shares_.try_emplace(user);
  Share& share = found->second;
  if (is_new) share.since = now;
  give_back(share, now);
  if (share.used == kMaxBurst) {
    ++share.left_out;
    return false;
  }
  if (share.used++ == 0) share.since = now;
  return true;
}

std::optional<LogShares::LeftOut> LogShares::next_left_out(Time now) {
  std::optional<LeftOut> result;
  for (auto it = shares_.begin(); it != shares_.end() && !result;) {
    Share& share = it->second;
    give_back(share, now);
    if (share.left_out != 0 && share.used < kMaxBurst) {
      ++share.used;
      result = LeftOut{it->first, std::exchange(share.left_out, 0)};
    }
    it = share.used == 0 ? shares_.erase(it) : std::next(it);
  }
  return result;
}

LogSink::LogSink(std::shared_ptr<logging::LogWriter> writer) : writer_(std::move(writer)) {}

void LogSink::sink_it_(const spdlog::details::log_msg& message) {
  while (const auto left_out = shares_.next_left_out(message.time)) {
    spdlog::details::log_msg summary = message;
    summary.level = spdlog::level::warn;
    write(std::move(summary), describe(*left_out), nullptr, left_out->user);
  }
  const auto user = LogAccount::current();
  if (user && !shares_.take(*user, message.time)) return;
  write(message, {message.payload.data(), message.payload.size()}, EventScope::current(), user);
}

void LogSink::write(spdlog::details::log_msg message, std::string_view text, const Event* event,
                    std::optional<uid_t> user) {
  const std::string clean = shm::printable(text);
  message.payload = clean;
  spdlog::memory_buf_t line;
  formatter_->format(message, line);
  if (user == LogAccount::kUnknown) user.reset();
  writer_->put({line.data(), line.size()}, writer_->has_journal()
                                               ? journal_record(clean, message.level, event, user)
                                               : std::string());
}

}  // namespace arbiter::service
