#include "gateway/core/outgoing.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "shm/clock.hpp"

namespace arbiter::gateway {
namespace {

// Whether this thread has the turn at any entry. What it sends may come back to it at once, if a
// topic leads to itself in a way that no check of the mapping sees; then the loop passes it on.
thread_local bool has_turn = false;

InputPort<void> open(Node& node, const Entry& entry) {
  InputPortOptions options;
  options.depth = entry.queue;
  const Type type = type_of(entry);
  return type.is_untyped() ? node.input_port(entry.port->name, options)
                           : node.input_port(entry.port->name, type, options);
}

}  // namespace

Type type_of(const Entry& entry) {
  if (!entry.type) return Type::untyped(entry.max_size);
  if (entry.type->size == 0) return Type::variable(entry.type->name, entry.max_size);
  return {entry.type->name, entry.type->size, entry.type->alignment};
}

Outgoing::Outgoing(Node& node, const Entry& entry, Sender& sender, Account& account,
                   const AgesOfSources& ages)
    : entry_(entry), sender_(sender), account_(account), ages_(ages), port_(open(node, entry)) {}

Outgoing::~Outgoing() { drop_draft(); }

void Outgoing::lead(const FeedBySource& feeds, std::function<void()> call_loop) {
  feeds_ = &feeds;
  call_loop_ = std::move(call_loop);
}

void Outgoing::run(shm::Nanoseconds now) {
  // A publisher that never rests would have each next turn, and the loop none.
  loop_waits_.store(true, std::memory_order_relaxed);
  const std::lock_guard lock(turn_);
  loop_waits_.store(false, std::memory_order_relaxed);
  has_turn = true;
  send_waiting(now);
  send_idle(now);
  next_.store(when_next(), std::memory_order_relaxed);
  has_turn = false;
}

void Outgoing::send_waiting(shm::Nanoseconds now) {
  // Other ports have their turn: a publisher that never rests must not keep the loop here.
  has_more_ = true;
  for (std::uint32_t i = 0; i < kMostAtOnce; ++i) {
    auto sample = left_ ? std::exchange(left_, {}) : port_.take();
    if (!sample) {
      has_more_ = false;
      break;
    }
    // To send one to a subscriber that is full takes a while, here and at the ports before.
    const shm::Nanoseconds age = std::max(now, shm::monotonic_now()) - sample->stamp_ns();
    if (age > ages_.of(sample->source())) {
      note_late();
      drop_draft();
      continue;
    }
    Feed* const in = feed_of(sample->source());
    if (in != nullptr && !has_right_header(*in, (*sample)->size())) {
      drop_draft();
      continue;
    }
    account_for(sender_.send(bytes_of(*sample)), (*sample)->size());
    drop_draft();
    if (in != nullptr) in->follow(*this);
  }
}

Feed* Outgoing::feed_of(std::string_view source) const noexcept {
  if (feeds_ == nullptr) return nullptr;
  const auto found = feeds_->find(source);
  return found == feeds_->end() ? nullptr : found->second;
}

// Which entries are connected only the model says, which a gateway does not read: who has not let
// `arbiter check` compare the two learns it here. Such samples never go straight on.
bool Outgoing::has_right_header(const Feed& in, std::size_t size) {
  if (have_one_header(in.entry(), entry_)) return true;
  account_for(Sender::Result::kUnreadable, size);
  if (std::exchange(told_, &in) != &in) {
    account_.set_last_reason("the last bad sample has " + header_text(in.entry()) + "; " +
                             header_advice(in.entry(), entry_));
  }
  return false;
}

void Outgoing::send_idle(shm::Nanoseconds now) {
  // Taken before the look at the port: a reader that comes in between is served the next time.
  const bool has_matched = matched_.exchange(false, std::memory_order_relaxed);
  if (!port_.idle() && !is_unheard_) {
    idle_again_.reset();
    return;
  }
  if (idle_again_ && now < *idle_again_ && !has_matched) return;
  idle_again_ = now + kIdlePeriod;
  send_idle_sample();
}

void Outgoing::send_idle_sample() noexcept {
  if (entry_.idle.kind == Idle::Kind::kNothing) return;
  const auto result = sender_.send({entry_.idle.sample.data(), entry_.idle.sample.size()});
  if (result == Sender::Result::kSent) account_.idle.add();
  if (result == Sender::Result::kRefused) account_.refused.add();  // else it is sent again soon
}

void Outgoing::end() noexcept {
  loop_waits_.store(true, std::memory_order_relaxed);
  const std::lock_guard lock(turn_);
  loop_waits_.store(false, std::memory_order_relaxed);
  has_ended_ = true;
  has_turn = true;
  send_idle_sample();
  has_turn = false;
}

bool Outgoing::begin_turn(std::size_t bytes) noexcept {
  if (bytes > sender_.largest_at_once()) return false;
  if (has_turn || loop_waits_.load(std::memory_order_relaxed) || !turn_.try_lock()) return false;
  if (has_more_ || has_ended_) {
    turn_.unlock();
    return false;
  }
  has_turn = true;
  port_.disarm();
  return true;
}

WritableBytes Outgoing::draft(std::size_t bytes) noexcept {
  if (bytes < kSmallestDraft) return {};
  const WritableBytes room = sender_.draft(bytes);
  if (!room.empty()) draft_ = Draft{room, shm::monotonic_now()};
  return room;
}

// Arbiter's memory has the bytes only where they are read: by others, who are handed them in
// publish(), or by the loop, which finds them in the queue.
bool Outgoing::publish_draft(OutputPort<void>& port, Loan<void> loan, Time deadline) {
  draft_->unwritten = {loan.data(), loan.size()};
  const Published published =
      port.publish(std::move(loan), deadline, port_, [this] { write_draft(); });
  draft_->sequence = published.sequence;
  if (published.sequence == 0) draft_->unwritten = {};
  return published.outcome.late;
}

void Outgoing::write_draft() noexcept {
  const WritableBytes to = std::exchange(draft_->unwritten, {});
  if (!to.empty()) std::memcpy(to.data(), draft_->bytes.data(), to.size());
}

// Of the turn's source: nobody but this thread publishes for it. A port that had its name before
// counted anew, but earlier.
bool Outgoing::is_drafted(const Sample<void>& sample, shm::Nanoseconds stamp) const noexcept {
  return draft_ && draft_->sequence != 0 && sample.sequence() == draft_->sequence &&
         stamp >= draft_->since;
}

// A draft outlives its turn only with its sample: as left_, whose bytes nobody has written.
Bytes Outgoing::bytes_of(const Sample<void>& sample) const noexcept {
  return draft_ ? Bytes(draft_->bytes.data(), draft_->bytes.size()) : *sample;
}

void Outgoing::drop_draft() noexcept {
  if (!draft_) return;
  draft_.reset();
  sender_.drop_draft();
}

Sender::Result Outgoing::send_in_turn(const Sample<void>& sample, shm::Nanoseconds stamp) noexcept {
  if (is_drafted(sample, stamp)) {
    const Sender::Result result = sender_.send_draft();
    if (result != Sender::Result::kBusy) draft_.reset();
    return result;
  }
  // One that is too large may have come before the turn, and the loop not to it yet.
  if (sample.size() > sender_.largest_at_once()) return Sender::Result::kBusy;
  return sender_.send_at_once(*sample);
}

// take() throws only where more samples are held than here ever are.
// NOLINTNEXTLINE(bugprone-exception-escape)
bool Outgoing::end_turn(std::string_view source, shm::Nanoseconds max_age) noexcept {
  bool has_come = false;
  bool is_draft_left = false;
  has_more_ = true;
  for (std::uint32_t i = 0; i < kMostAtOnce; ++i) {
    auto sample = port_.take();
    if (!sample) {
      has_more_ = false;
      break;
    }
    // A sample of another source is left to the loop, which knows how old it may be.
    if (sample->source() != source) {
      left_ = std::move(sample);
      break;
    }
    has_come = true;
    const shm::Nanoseconds stamp = sample->stamp_ns();  // each call reads the clock
    if (shm::monotonic_now() - stamp > max_age) {
      note_late();
      continue;
    }
    const Sender::Result result = send_in_turn(*sample, stamp);
    if (result == Sender::Result::kBusy) {
      is_draft_left = is_drafted(*sample, stamp);
      left_ = std::move(sample);
      break;
    }
    account_for(result, (*sample)->size());
  }
  if (draft_ && !is_draft_left) {
    write_draft();  // the loop may find it in the queue
    drop_draft();
  }
  // Nobody rings for a port that is disarmed, and the last take may have swallowed a ring and have
  // set a timer again that had expired: what has become idle meanwhile only this look finds. The
  // port is armed: what becomes idle from now on rings.
  const bool has_idle_sample = entry_.idle.kind != Idle::Kind::kNothing;
  const bool became_idle =
      has_idle_sample && !has_more_ && !idle_again_ && (port_.idle() || is_unheard_);
  if (became_idle) idle_again_ = 0;  // it is due
  next_.store(when_next(), std::memory_order_relaxed);
  const bool calls_loop = has_more_ || became_idle;
  has_turn = false;
  turn_.unlock();
  if (calls_loop) call_loop_();
  return has_come;
}

shm::Nanoseconds Outgoing::when_next() const noexcept {
  if (has_more_) return 0;
  if (entry_.idle.kind == Idle::Kind::kNothing) return shm::kForever;
  return idle_again_.value_or(shm::kForever);
}

// Whose T is for ever may have nothing newer to say.
void Outgoing::note_late() noexcept {
  is_unheard_ = true;
  account_.late.add();
}

void Outgoing::account_for(Sender::Result result, std::size_t size) noexcept {
  is_unheard_ = result != Sender::Result::kSent;
  // Somebody commands: the next idle sample must not wait for its period.
  if (!is_unheard_) idle_again_.reset();
  switch (result) {
    case Sender::Result::kSent:
      account_.passed.add();
      account_.set_last_size(size);
      return;
    case Sender::Result::kNotReady:
    case Sender::Result::kRefused:
    case Sender::Result::kBusy:
      account_.refused.add();
      return;
    case Sender::Result::kUnreadable:
      account_.unreadable.add();
      return;
    case Sender::Result::kNoMemory:
      account_.no_slot.add();
      return;
    case Sender::Result::kTooLarge:
      account_.too_large.add();
      return;
  }
}

}  // namespace arbiter::gateway
