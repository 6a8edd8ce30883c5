#include "gateway/iceoryx/iceoryx.hpp"

#include <algorithm>
#include <iostream>
#include <utility>

#include <iceoryx_hoofs/error_handling/error_handling.hpp>
#include <iceoryx_hoofs/log/logmanager.hpp>

#include "gateway/core/say.hpp"
#include "gateway/iceoryx/runtime.hpp"
#include "shm/clock.hpp"

namespace arbiter::gateway {
namespace {

constexpr shm::Nanoseconds kSecond = 1'000'000'000;
constexpr shm::Nanoseconds kHangs = 2 * kSecond;  // RouDi does not answer
// RouDi sends something once a second to each process that it knows. It forgets a process that it
// has not heard from for a while, even if it was RouDi that did not run. The ends of that process
// are then dead, and nothing reports it.
constexpr shm::Nanoseconds kSilent = 5 * kSecond;
constexpr shm::Nanoseconds kSilentTooLong = 10 * kSecond;
constexpr shm::Nanoseconds kHangsInside = 5 * kSecond;  // the thread does not come out of a call

constexpr const char* kAnotherGroup = "RouDi is of another group than this user";

const char* why_no_roudi() {
  return is_closed_to_us(roudi_socket_path()) ? kAnotherGroup : "RouDi does not run";
}

const char* why_no_answer() {
  return are_ours_closed_to(roudi_socket_path()) ? kAnotherGroup : "RouDi does not answer";
}

// iceoryx ends the process at what it holds for fatal, and, where it was built with assertions, at
// less. What is less is answered by the call that found it.
void handle_error(iox::Error error, const std::function<void()>&, iox::ErrorLevel level) {
  if (level != iox::ErrorLevel::FATAL) {
    last_fault_of_iceoryx = iox::ErrorHandler::toString(error);
    return;
  }
  const std::string made = what_is_made();
  const std::string why_not = why_no_traces();
  say(Level::kError, std::string("iceoryx gives up: ") + iox::ErrorHandler::toString(error) +
                         (made.empty() ? "" : ": RouDi refuses " + made) +
                         (why_not.empty() ? "" : ": " + why_not));
  finish_saying();
  std::_Exit(1);
}

}  // namespace

Iceoryx::Iceoryx(std::string name) : name_(std::move(name)) {
  iox::log::LogManager::GetLogManager().SetDefaultLogLevel(iox::log::LogLevel::kError,
                                                           iox::log::LogLevelOutput::kHideLogLevel);
  // For each sample for which no chunk is left, iceoryx writes a line, past its own log and error
  // handler: a subscriber that keeps what it gets would fill a disk. The account counts them.
  std::cerr.setstate(std::ios::badbit);
  static const auto handler = iox::ErrorHandler::setTemporaryErrorHandler(handle_error);
}

Iceoryx::~Iceoryx() { stop(); }

Sender& Iceoryx::sender(const Gateway&, const Entry& entry, Account& account) {
  return *outs_.emplace_back(Out{std::make_unique<ChunkSender>(entry, account)}).sender;
}

void Iceoryx::start(const std::vector<OpenIn>& ins, const std::vector<OpenOut>& outs) {
  for (const OpenIn& in : ins) {
    ins_.push_back(in);
    in.account.set_obstacle(obstacle_);
  }
  for (const OpenOut& open : outs) {
    const auto out = std::find_if(outs_.begin(), outs_.end(), [&](const Out& each) {
      return &each.sender->entry() == &open.outgoing.entry();
    });
    out->outgoing = &open.outgoing;
    out->sender->serve();
    out->had_readers = false;
  }
  if (session_ != nullptr) session_->add(ins);
  has_started_ = true;
  tend();
}

void Iceoryx::stop() noexcept {
  session_.reset();
  has_started_ = false;
}

void Iceoryx::set_obstacle(const std::string& text) {
  if (text == obstacle_) return;
  obstacle_ = text;
  for (const OpenIn& in : ins_) in.account.set_obstacle(text);
  tell_obstacles();
}

void Iceoryx::tell_obstacles() {
  for (Out& out : outs_) {
    const std::string fault = out.sender->fault();
    const std::string text = obstacle_ + (obstacle_.empty() || fault.empty() ? "" : "; ") + fault;
    if (text == out.obstacle) continue;
    out.obstacle = text;
    out.sender->account().set_obstacle(text);
  }
}

void Iceoryx::tend() {
  if (!has_started_) return;
  const auto roudi = find_roudi(roudi_socket_path());
  const shm::Nanoseconds now = shm::monotonic_now();
  if (session_ == nullptr) {
    set_obstacle(roudi ? "RouDi has just come" : why_no_roudi());
    if (!roudi) return;
    std::vector<ChunkSender*> senders;
    for (const Out& each : outs_) senders.push_back(each.sender.get());
    joined_ = told_roudi_ = now;
    session_ = std::make_unique<Session>(name_, *roudi, ins_, senders);
    return;
  }
  if (roudi != session_->roudi()) throw NeedsNewProcess("RouDi has gone");
  if (session_->has_stalled()) {
    throw NeedsNewProcess("the gateway was held up, so that RouDi may have given it up");
  }
  if (!session_->is_ready()) {
    if (now - joined_ > kHangs) set_obstacle(why_no_answer());
    return;
  }
  if (now - session_->last_round() > kHangsInside) {
    throw NeedsNewProcess("a call of iceoryx does not return");
  }
  const shm::Nanoseconds silence = now - session_->heard_roudi();
  if (silence > kSilentTooLong && !is_roudi_stopped()) {
    throw NeedsNewProcess("RouDi runs but is silent: it has given the gateway up");
  }
  if (can_be_told(roudi_socket_path())) told_roudi_ = now;
  const bool hangs = silence > kSilent || now - told_roudi_ > kSilent;
  set_obstacle(hangs ? "RouDi does not answer" : "");
  look_after_senders();
  tell_obstacles();
}

void Iceoryx::look_after_senders() {
  for (Out& out : outs_) {
    const Publisher* const publisher = out.sender->publisher();
    if (publisher == nullptr) continue;
    const bool has_readers = publisher->hasSubscribers();
    out.sender->account().set_peers(has_readers ? 1 : 0, true);
    if (has_readers && !out.had_readers && out.outgoing != nullptr) out.outgoing->peer_matched();
    out.had_readers = has_readers;
  }
}

}  // namespace arbiter::gateway
