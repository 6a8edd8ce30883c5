// wait_for(), fd(), idle() and winner(): who commands now, and sleeping until that matters.
//
// A port is idle when no connection to it is selected, or the one that is cannot deliver. The
// component learns it once for each time that it had been commanded before. Nothing runs while it
// sleeps: a sample rings the bell; so does a source whose activity begins or ends and thereby makes
// what the port believes of itself untrue, and a view of other peers; and where activity is going
// to run out by itself, the sleep ends at that time.
#include <sys/epoll.h>
#include <sys/timerfd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "client/count.hpp"
#include "client/input/input_core.hpp"

namespace arbiter::detail {
namespace {

shm::Nanoseconds after(shm::Nanoseconds now, shm::Nanoseconds timeout) {
  return timeout > shm::kMaxTime - now ? shm::kForever : now + timeout;
}

}  // namespace

Waited InputCore::wait(shm::Nanoseconds timeout, HeldSample& sample) {
  const Waited result = wait_once(timeout, sample);
  // A descriptor in use was disarmed by this; let its owner's loop arm it again.
  if (epoll_) shm::ring_bell(bell_.write_end().get());
  return result;
}

Waited InputCore::wait_once(shm::Nanoseconds timeout, HeldSample& sample) {
  shm::Nanoseconds deadline =
      -1;  // read when it is first needed: a sample that waits costs no clock
  for (;;) {
    sample = take_once();
    if (sample.data != nullptr) return Waited::kSample;
    shm::Command command = who_commands();
    if (commanded_ && command.commander.source == shm::kNone) {
      commanded_ = false;
      count(segment_->header.counters.idles);
      return Waited::kIdle;
    }
    const shm::Nanoseconds now = shm::monotonic_now();
    if (deadline < 0) deadline = after(now, timeout);
    if (now >= deadline) return Waited::kTimeout;
    if (arm(sample, command)) {
      // Whatever else happens rings: a sample, or a begin or an end that makes another the winner.
      bell_.wait(std::min(deadline, picture_.first_end(command.commander)));
      count(segment_->header.counters.wakes);
    }
    disarm();
    if (sample.data != nullptr) return Waited::kSample;
  }
}

// Says that we wait and what we believe, then looks once more; true if it is still so.
// SYNC POINT: waiting. Fence (d), between our wait word and our last look. Pairs with fences (a)
// and (b) of publishers: either we see what they did, or they see us wait.
// What we believe is the selection, which publishers can judge, and not whether it can deliver.
bool InputCore::arm(HeldSample& sample, shm::Command& command) {
  shm::InputHeader& header = segment_->header;
  const shm::SourceId believed = command.selected.source;
  const shm::SourceId commander = command.commander.source;
  header.believed.store(believed, std::memory_order_relaxed);
  // Relaxed is enough: a publisher that sees us wait and does not see what we believe has passed
  // its fence before ours; then our last look sees what it has done, and we do not sleep.
  wait_anew();
  sample = take_once();
  if (sample.data != nullptr) return false;
  command = who_commands();
  return command.selected.source == believed && command.commander.source == commander;
}

// The next wait has another number. What rang for this one is forgotten before the next begins.
void InputCore::disarm() noexcept {
  stop_waiting();
  bell_.silence();
}

void InputCore::stop_waiting() noexcept {
  shm::InputHeader& header = segment_->header;
  const std::uint64_t wait = header.wait.load(std::memory_order_relaxed);
  if ((wait & 1) != 0) header.wait.store(wait + 1, std::memory_order_relaxed);
}

// The next wait, and fence (d). A take that throws leaves the last wait as it was, odd.
void InputCore::wait_anew() noexcept {
  shm::InputHeader& header = segment_->header;
  header.wait.store((header.wait.load(std::memory_order_relaxed) + 1) | 1,
                    std::memory_order_relaxed);
  shm::full_fence();
}

// In one picture, under the model that was in force while it was taken.
shm::Command InputCore::who_commands() noexcept {
  shm::DecisionClock clock(last_reading_, false);
  for (int tries = 0; tries < shm::kMaxPictures; ++tries) {
    refresh();
    if (picture_.take(clock, 1) && memory_->tables().is_in_force(snapshot_)) break;
  }
  last_reading_ = clock.reading();
  const shm::Command command =
      picture_.command([this](const shm::Rule& rule) { return can_deliver(rule); });
  if (command.commander.source != shm::kNone) commanded_ = true;
  return command;
}

// Whether anything of a selected connection can come: a component has the source open and is
// connected, or something of it waits, or it is but silent for a while. What a view does not tell
// yet is as if it came later: its offer rings.
bool InputCore::can_deliver(const shm::Rule& rule) noexcept {
  bool waits = false;
  bool refused = is_refused(rule.source);
  for (Queue& queue : queues_) {
    if (queue.peer->source != rule.source) continue;
    if (queue.reader.state() == shm::ChannelReader::State::kMisbehaved) {
      refused = true;
      continue;
    }
    if (!queue.gone) return true;
    // The entry counts, and not the publisher's count of them: it may have died between the two.
    waits = look_closely(queue) || waits;
    queue.head = 0;  // for a take to find
  }
  if (refused) return false;
  return waits || ends_by_itself(rule.source);
}

// Relaxed is enough: where an arrival comes at this very moment its publisher has the source open,
// of which the next view tells.
bool InputCore::ends_by_itself(shm::SourceId source) const noexcept {
  const shm::Activity* const activity = memory_->pages().find(source);
  if (activity == nullptr) return true;
  const shm::ActivityWord word = activity->word.load(std::memory_order_relaxed);
  return shm::ends_within(word, snapshot_.table.timeout(source), shm::monotonic_now());
}

bool InputCore::is_refused(shm::SourceId source) const noexcept {
  if (view_ == nullptr) return false;
  const auto& refused = view_->refused;
  return std::find(refused.begin(), refused.end(), source) != refused.end();
}

std::optional<std::string_view> InputCore::winner() noexcept {
  const shm::SourceId commander = who_commands().commander.source;
  if (commander == shm::kNone || !snapshot_.table.is_arbitrated(port_)) return std::nullopt;
  return memory_->source_name(commander);
}

bool InputCore::is_idle() noexcept { return who_commands().commander.source == shm::kNone; }

// A descriptor for the user's own loop: the bell, and a timer for the time at which activity runs
// out.
int InputCore::wait_descriptor() {
  if (epoll_) return epoll_.get();
  shm::FileDescriptor epoll(epoll_create1(EPOLL_CLOEXEC));
  shm::FileDescriptor timer(timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC));
  epoll_event event{};
  event.events = EPOLLIN;
  if (!epoll || !timer || epoll_ctl(epoll.get(), EPOLL_CTL_ADD, bell_.read_end(), &event) != 0 ||
      epoll_ctl(epoll.get(), EPOLL_CTL_ADD, timer.get(), &event) != 0) {
    throw Error(name_ + ": no descriptor to wait on: " + std::strerror(errno));
  }
  epoll_ = std::move(epoll);
  timer_ = std::move(timer);
  shm::close_in_children(epoll_);
  shm::close_in_children(timer_);
  shm::ring_bell(bell_.write_end().get());  // what waits already is there to be taken
  return epoll_.get();
}

// Relaxed is enough: a publisher that still sees us wait rings for nothing. What has rung is left
// to be heard, also when the descriptor is armed again: a system call for each sample would cost
// more than to wake the loop once for nothing.
void InputCore::disarm_descriptor() noexcept {
  if (!epoll_) return;
  stop_waiting();
  is_disarmed_ = true;
}

// As arm(), with the belief of the last time. If that is the source of the last sample, its
// connection's decision, which the take has just read, says whether it still holds: no picture of
// the port is needed, which would be fetched into cold caches for each sample. Not where a port may
// select several: one decision does not say which is the first.
//
// The source's own activity and those that its rule reads need not be of one moment. Each look
// comes behind fence (d). So if nothing is written after the fence, they show what is selected; and
// whoever writes after it sees us wait, and rings where the port then selects another. All are
// judged by one reading of the clock, and the timer is set to the first end after that.
bool InputCore::arm_again(HeldSample& sample) {
  if (!believes_last_taken()) return false;
  wait_anew();
  sample = take_once();
  if (sample.data != nullptr || !believes_last_taken()) return false;  // it has bound anew
  Queue& queue = queues_[last_taken_];
  if (queue.own == nullptr) return false;
  const shm::ActivityWord own = queue.own->word.load(std::memory_order_relaxed);
  shm::DecisionClock clock(last_reading_, false);
  if (shm::is_finite(own)) clock.read();
  const bool wins = queue.rule.decide(snapshot_.table, clock) == shm::Verdict::kWins;
  last_reading_ = clock.reading();
  if (!wins || !shm::is_active(own, last_reading_)) return false;
  if (!memory_->tables().is_in_force(snapshot_)) return false;
  commanded_ = true;
  set_timer(std::min(shm::is_finite(own) ? own : shm::kForever, queue.rule.until()));
  return true;
}

// Whether the port believes in the source of the last sample, of which more can come.
bool InputCore::believes_last_taken() const noexcept {
  if (last_taken_ == kNoQueue || !selects_one_) return false;
  const Queue& queue = queues_[last_taken_];
  return !queue.gone && queue.reader.state() != shm::ChannelReader::State::kMisbehaved &&
         queue.peer->source == segment_->header.believed.load(std::memory_order_relaxed);
}

// After a take that found nothing: from now on the descriptor becomes readable when there is cause.
void InputCore::arm_descriptor(HeldSample& sample) {
  if (!std::exchange(is_disarmed_, false)) disarm();
  if (arm_again(sample) || sample.data != nullptr) return;
  for (;; disarm()) {
    shm::Command command = who_commands();
    const bool armed = arm(sample, command);
    if (sample.data != nullptr) return;
    if (!armed) continue;
    set_timer(picture_.first_end(command.commander));
    return;
  }
}

// A commander that publishes moves the change away with each sample. A timer that expires too early
// wakes the loop once, for nothing; to set it for each sample would cost a system call for each.
void InputCore::set_timer(shm::Nanoseconds change_at) noexcept {
  const bool has_expired = timer_at_ != shm::kForever && timer_at_ <= shm::monotonic_now();
  if (change_at >= timer_at_ && !has_expired) return;
  itimerspec at{};  // zero: no alarm
  if (change_at != shm::kForever) {
    at.it_value = {change_at / 1'000'000'000, change_at % 1'000'000'000};
  }
  timerfd_settime(timer_.get(), TFD_TIMER_ABSTIME, &at, nullptr);
  timer_at_ = change_at;
}

}  // namespace arbiter::detail
