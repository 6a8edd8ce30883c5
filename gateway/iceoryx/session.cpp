#include "gateway/iceoryx/session.hpp"

#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <utility>

#include <iceoryx_hoofs/log/logmanager.hpp>
#include <iceoryx_posh/runtime/posh_runtime.hpp>

#include "gateway/core/freshness.hpp"
#include "gateway/core/say.hpp"
#include "gateway/iceoryx/runtime.hpp"
#include "shm/clock.hpp"

namespace arbiter::gateway {
namespace {

constexpr shm::Nanoseconds kMillisecond = 1'000'000;
// Rounds without anything to take: so that the loop sees that the thread goes round.
constexpr shm::Nanoseconds kLongestWait = 250 * kMillisecond;
// Topics that no WaitSet has room for are looked at that often: an emergency stop may be one.
constexpr shm::Nanoseconds kUnwatchedPeriod = 5 * kMillisecond;
constexpr shm::Nanoseconds kListPeriod = 200 * kMillisecond;
// RouDi writes a line each time that it refuses.
constexpr shm::Nanoseconds kMakePeriod = 5000 * kMillisecond;
// RouDi needs a tenth of a second to connect who is in its list.
constexpr int kLooksUntilRefused = 10;
constexpr std::size_t kMostNames = 3;
// RouDi gives up a process that has not been heard of for 1.5 s, whose ends are dead from then on
// although nothing tells it so. What keeps its keep-alive from running keeps this thread, too.
constexpr shm::Nanoseconds kGivenUp = 1200 * kMillisecond;

thread_local std::string made;

// A status has room for a few, and so has a log that is to be read.
std::string some_of(const std::vector<std::string>& names) {
  std::string text;
  const std::size_t most = names.size() == kMostNames + 1 ? kMostNames + 1 : kMostNames;
  for (std::size_t i = 0; i < std::min(names.size(), most); ++i) {
    text += (i == 0 ? "" : ", ") + names[i];
  }
  if (names.size() > most) text += " and " + std::to_string(names.size() - most) + " others";
  return text;
}

// The largest alignment that a header of that size may have: iceoryx wants the size to be a
// multiple, and no more than its own header's alignment.
std::uint32_t alignment_of_header(std::uint32_t size) {
  std::uint32_t alignment = 1;
  while (alignment < alignof(iox::mepoo::ChunkHeader) && size % (2 * alignment) == 0) {
    alignment *= 2;
  }
  return alignment;
}

}  // namespace

Sender::Result ChunkSender::send(Bytes sample) noexcept {
  Publisher* const to = publisher();
  if (to == nullptr) return Result::kNotReady;
  const IceoryxTopic& topic = *entry_.iceoryx;
  const std::size_t header = topic.padded_header();
  if (sample.size() < header || sample.size() - header > UINT32_MAX) return Result::kTooLarge;
  auto loan = to->loan(static_cast<std::uint32_t>(sample.size() - header), topic.alignment,
                       topic.user_header, alignment_of_header(topic.user_header));
  if (loan.has_error()) {
    const bool is_none = loan.get_error() == iox::popo::AllocationError::NO_MEMPOOLS_AVAILABLE;
    account_.set_last_reason((is_none ? "RouDi has no memory pool for chunks of "
                                      : "RouDi's memory pool is exhausted, for ") +
                             std::to_string(sample.size() - header) + " bytes");
    return is_none ? Result::kTooLarge : Result::kNoMemory;
  }
  void* const payload = loan.value();
  if (topic.user_header != 0) {
    std::memcpy(iox::mepoo::ChunkHeader::fromUserPayload(payload)->userHeader(), sample.data(),
                topic.user_header);
  }
  std::memcpy(payload, sample.data() + header, sample.size() - header);
  to->publish(payload);
  return Result::kSent;
}

// Why there is no chunk, send() says.
WritableBytes ChunkSender::draft(std::size_t bytes) noexcept {
  Publisher* const to = publisher();
  if (to == nullptr || entry_.iceoryx->padded_header() != 0 || bytes > UINT32_MAX) return {};
  auto loan = to->loan(static_cast<std::uint32_t>(bytes), entry_.iceoryx->alignment);
  if (loan.has_error()) return {};
  draft_ = loan.value();
  return {static_cast<std::byte*>(draft_), bytes};
}

Sender::Result ChunkSender::send_draft() noexcept {
  publisher()->publish(std::exchange(draft_, nullptr));
  return Result::kSent;
}

void ChunkSender::drop_draft() noexcept { publisher()->release(std::exchange(draft_, nullptr)); }

std::string what_is_made() { return made; }

Session::Session(std::string gateway, RoudiIdentity roudi, std::vector<Middleware::OpenIn> ins,
                 const std::vector<ChunkSender*>& outs)
    : gateway_(std::move(gateway)), roudi_(roudi), ins_(std::move(ins)) {
  for (ChunkSender* const out : outs) outs_.push_back({out});
  thread_ = std::thread([this] { run(); });
}

Session::~Session() {
  ends_.store(true, std::memory_order_relaxed);
  for (int i = 0; i < 100 && !ended_.load(std::memory_order_relaxed); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  if (ended_.load(std::memory_order_relaxed)) {
    thread_.join();
    return;
  }
  // It hangs in a call on RouDi, and uses what is destroyed here.
  say(Level::kWarning, "RouDi does not answer: the gateway ends without taking leave of it");
  finish_saying();
  std::_Exit(1);
}

void Session::run() {
  pthread_setname_np(pthread_self(), "iceoryx");
  last_round_.store(shm::monotonic_now(), std::memory_order_relaxed);
  make_ends();
  last_round_.store(shm::monotonic_now(), std::memory_order_relaxed);
  heard_roudi_.store(shm::monotonic_now(), std::memory_order_relaxed);
  waits_.announce(*wait_set_);
  take_for_ever();
  wait_set_.reset();
  port_list_.reset();
  inlets_.clear();
  publishers_.clear();
  ended_.store(true, std::memory_order_relaxed);
}

void Session::make_ends() {
  iox::runtime::PoshRuntime::initRuntime(
      iox::RuntimeName_t(iox::cxx::TruncateToCapacity, runtime_name(gateway_, ::getpid())));
  for (Outlet& out : outs_) make_publisher(out);
  make_again_ = shm::monotonic_now() + kMakePeriod;
  made = "the subscriber of RouDi's list of ports";
  port_list_.emplace();
  wait_set_ = std::make_unique<iox::popo::WaitSet<>>();
  for (const Middleware::OpenIn& in : ins_) make_inlet(in);
  made.clear();
  // From here on it has a line for each sample that does not fit, and the account counts those.
  iox::log::LogManager::GetLogManager().SetDefaultLogLevel(iox::log::LogLevel::kOff,
                                                           iox::log::LogLevelOutput::kHideLogLevel);
  if (watches_all_) return;
  say(Level::kInfo, "iceoryx can watch " + std::to_string(wait_set_->size()) +
                        " topics at once; the others are looked at every 5 ms");
}

void Session::make_publisher(Outlet& out) {
  const Entry& entry = out.sender->entry();
  made = "the publisher of " + entry.outside();
  iox::popo::PublisherOptions options;
  options.historyCapacity = entry.iceoryx->history;
  try {
    last_fault_of_iceoryx.clear();
    publishers_.push_back(std::make_unique<Publisher>(service_of(*entry.iceoryx), options));
    out.sender->use(*publishers_.back());
    if (!std::exchange(out.not_made, {}).empty()) {
      say(Level::kInfo, entry.outside() + " is served now");
    }
  } catch (const RefusedByRoudi& refusal) {
    const std::string why = refusal.what();
    const std::string text = "RouDi refuses the publisher: " + why;
    if (std::exchange(out.not_made, text) != text) {
      say(Level::kError, "RouDi refuses " + made + ": " + why + "; trying again every 5 s");
    }
  }
  tell_fault(out);
}

void Session::make_refused(shm::Nanoseconds now) {
  if (now < make_again_) return;
  make_again_ = now + kMakePeriod;
  for (Outlet& out : outs_) {
    if (out.sender->publisher() == nullptr) make_publisher(out);
  }
  made.clear();
}

void Session::make_inlet(const Middleware::OpenIn& in) {
  made = "the subscriber of " + in.incoming.entry().outside();
  inlets_.push_back(std::make_unique<Inlet>(in));
  watches_all_ =
      watches_all_ && wait_set_->size() < wait_set_->capacity() &&
      !wait_set_->attachState(inlets_.back()->subscriber(), iox::popo::SubscriberState::HAS_DATA)
           .has_error();
}

void Session::add(const std::vector<Middleware::OpenIn>& ins) {
  const std::lock_guard lock(adding_);
  for (const Middleware::OpenIn& in : ins) added_.push_back(in);
  has_added_.store(true, std::memory_order_relaxed);
}

void Session::make_added() {
  if (!has_added_.load(std::memory_order_relaxed)) return;
  std::vector<Middleware::OpenIn> added;
  {
    const std::lock_guard lock(adding_);
    added.swap(added_);
    has_added_.store(false, std::memory_order_relaxed);
  }
  for (const Middleware::OpenIn& in : added) {
    make_inlet(in);
    inlets_.back()->take_all();  // from here on it is known to be empty
    inlets_.back()->count_publishers(*port_list_);
  }
  made.clear();
}

void Session::take_for_ever() {
  for (const auto& inlet : inlets_) inlet->take_all();  // from here on they are known to be empty
  while (!ends_.load(std::memory_order_relaxed)) {
    shm::Nanoseconds wait = watches_all_ ? kLongestWait : kUnwatchedPeriod;
    for (const auto& inlet : inlets_) {
      const shm::Nanoseconds age = inlet->max_age();
      wait = std::min(wait, std::max(kMillisecond, QueueFreshness::period(age)));
    }
    const auto woken = wait_set_->timedWait(
        iox::units::Duration::fromNanoseconds(static_cast<std::uint64_t>(wait)));
    static_cast<void>(woken);  // whoever it is, all are looked at: it costs a load for each
    const shm::Nanoseconds now = shm::monotonic_now();
    const shm::Nanoseconds before = last_round_.exchange(now, std::memory_order_relaxed);
    if (now - before > kGivenUp) stalled_.store(true, std::memory_order_relaxed);
    make_added();
    for (const auto& inlet : inlets_) inlet->take_all();
    look_at_list(now);
    make_refused(now);
  }
}

void Session::look_at_list(shm::Nanoseconds now) {
  if (now - looked_at_list_ < kListPeriod) return;
  looked_at_list_ = now;
  if (port_list_->hears_roudi()) heard_roudi_.store(now, std::memory_order_relaxed);
  if (port_list_->update()) {
    for (const auto& inlet : inlets_) inlet->count_publishers(*port_list_);
  }
  // Even if the list is the same: a process that has ended stays in it for a while.
  for (Outlet& out : outs_) {
    look_for_strangers(out, now);
    look_for_refused(out);
    tell_fault(out);
  }
}

// RouDi connects no subscriber that asks for what its publisher does not offer, and tells neither.
void Session::look_for_refused(Outlet& out) const {
  if (out.sender->publisher() == nullptr) return;
  const auto subscribers = port_list_->subscribers_of(*out.sender->entry().iceoryx);
  if (subscribers.empty() || out.sender->publisher()->hasSubscribers()) {
    out.looks_without_any = 0;
    out.refused.clear();
  } else if (++out.looks_without_any >= kLooksUntilRefused) {
    out.refused = subscribers.front();
  }
}

// What does not pass the gateway can bypass it. Of a topic that is another gateway's here, that one
// says so.
void Session::look_for_strangers(Outlet& out, shm::Nanoseconds now) const {
  if (!out.sender->is_served()) return;
  const std::string own = runtime_name(gateway_, ::getpid());
  std::vector<std::string> strangers;
  std::vector<std::string> gateways;
  for (const std::string& runtime : port_list_->publishers_of(*out.sender->entry().iceoryx)) {
    const auto process = process_of(gateway_, runtime);
    const bool has_ended = process && ::kill(*process, 0) != 0 && errno == ESRCH;
    if (runtime == own || has_ended) continue;
    (process ? gateways : strangers)
        .push_back(process ? "pid " + std::to_string(*process) : runtime);
  }
  std::string text;
  if (!strangers.empty()) {
    text = "others publish there too, past all arbitration: " + some_of(strangers);
  }
  if (!gateways.empty()) {
    text += (text.empty() ? "" : "; ") + ("another gateway has this topic: " + some_of(gateways));
  }
  out.strangers = text;
  // Those who come and go without end must not fill a disk.
  if (!out.news.take(text, now)) return;
  say(Level::kWarning,
      out.sender->entry().outside() + ": " + text +
          (strangers.empty()
               ? "; subscribers get what both send: end one of the two, or give it another topic"
               : "; let them publish to another topic, and map that one with <in>"));
}

void Session::tell_fault(const Outlet& out) {
  std::string text = out.not_made;
  if (!out.strangers.empty()) text += (text.empty() ? "" : "; ") + out.strangers;
  if (!out.refused.empty()) {
    text += (text.empty() ? "" : "; ") + ("no subscriber matched; " + out.refused) +
            " subscribes and is not connected: it asks for history=\"…\", or that publishers wait "
            "when its queue is full, which no gateway does";
  }
  out.sender->set_fault(std::move(text));
}

}  // namespace arbiter::gateway
