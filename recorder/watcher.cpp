#include "recorder/watcher.hpp"

#include <fcntl.h>
#include <sys/resource.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "rules/model/quantifiers.hpp"
#include "rules/text/names.hpp"
#include "shm/clock.hpp"
#include "shm/descriptor_limit.hpp"

namespace arbiter::recorder {
namespace {

using evidence::ActivityWord;

constexpr std::chrono::milliseconds kLookAtPagesEvery{10};
// A source that could not be tapped is tried again, less and less often: there may be room now, or
// a daemon.
constexpr Nanoseconds kTryAgainAfter = 1'000'000'000;
constexpr Nanoseconds kTryAgainAtLeastEvery = 32'000'000'000;
// Some four for each source that an instance can have. A few are for the files that are written,
// and for those who ask for them.
constexpr rlim_t kMostDescriptors = 65'536;
constexpr rlim_t kSpareDescriptors = 32;
// Until it has begun again, nothing is recorded.
constexpr Nanoseconds kBeginAgainAfter = 20'000'000;
constexpr Nanoseconds kBeginAtLeastEvery = 2'000'000'000;

// The lowest number that is free is taken first: where this one is taken, nearly all are.
void require_descriptors() {
  rlimit limit{};
  const bool has_some = ::getrlimit(RLIMIT_NOFILE, &limit) == 0 &&
                        limit.rlim_cur > kSpareDescriptors &&
                        ::fcntl(static_cast<int>(limit.rlim_cur - kSpareDescriptors), F_GETFD) < 0;
  if (has_some) return;
  throw Error("no descriptors are left for more taps: raise the limit (ulimit -n, LimitNOFILE=)");
}

}  // namespace

Watcher::Watcher(const RecorderOptions& options, RecordQueue& queue)
    : options_(options), queue_(queue) {
  shm::raise_descriptor_limit(kMostDescriptors);
  instance_ = std::make_unique<watch::Instance>(options_.caller);
  begin();
}

void Watcher::start() {
  thread_ = std::thread([this] { run(); });
}

void Watcher::stop() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
    stopping_.notify_one();
  }
  if (thread_.joinable()) thread_.join();
}

Watcher::NewTaps Watcher::take_taps(const std::function<void()>& forget_all) {
  const std::lock_guard lock(mutex_);
  if (!to_start_.empty()) forget_all();
  for (Batch& batch : std::exchange(to_start_, {})) queue_.push(std::move(batch));
  return std::exchange(new_taps_, {});
}

// Behind a start that waits.
void Watcher::push(Batch&& batch) {
  const std::lock_guard lock(mutex_);
  if (to_start_.empty()) {
    queue_.push(std::move(batch));
  } else {
    to_start_.push_back(std::move(batch));
  }
}

void Watcher::run() {
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      if (stopping_.wait_for(lock, kLookAtPagesEvery, [this] { return is_stopping_; })) return;
    }
    try {
      look();
    } catch (const std::exception&) {  // the daemon has gone, or refuses for now: another time
    }
  }
}

void Watcher::tell_of_daemon() {
  const watch::DaemonPresence::Change change = presence_.look(*instance_);
  if (change.has_gone) {
    options_.say("the daemon has gone; its last decisions stay in force, and recording goes on");
  }
  if (change.is_back) options_.say("a daemon is there again");
}

// Before the end of the recording says how much is missing.
void Watcher::tell_of_disk() {
  if (is_disk_slow_) return;
  const Waiting waiting = queue_.waiting();
  is_disk_slow_ = Backlog{waiting, options_.queue_bytes}.room() != Room::all;
  if (!is_disk_slow_) return;
  options_.say("the disk is slow, and " + std::to_string(waiting.all() >> 20) +
               " MiB wait for it: payloads are left out, and where there are more, events; the "
               "file says where");
}

void Watcher::look() {
  const Nanoseconds now = shm::monotonic_now();
  instance_->update();
  tell_of_daemon();
  tell_of_disk();
  if (instance_->memory() != memory_) {
    begin_again();
    return;
  }
  look_at_pages();  // first: the daemon may be silent
  ask_daemon();
  if (options_.ports.empty()) {
    look_for_newcomers();
    had_all_ = now;
  }
  try_refused();
}

// Where that fails, because the new daemon is busy with others, say, it is tried again.
void Watcher::begin_again() {
  const Nanoseconds now = shm::monotonic_now();
  if (!instance_->has_daemon() || now < next_begin_) return;
  if (memory_ != nullptr) {
    options_.say("a daemon has come that does not know what was before: recording starts again");
  }
  try {
    begin();
    begin_pause_ = 0;
  } catch (const std::exception& error) {
    memory_.reset();
    if (begin_pause_ == 0) {
      options_.say(std::string("recording has not started again; it is tried again: ") +
                   error.what());
    }
    begin_pause_ = std::clamp(2 * begin_pause_, kBeginAgainAfter, kBeginAtLeastEvery);
    next_begin_ = now + begin_pause_;
  }
}

// Taps first, then pages: what a source does after its page was read, its tap tells.
void Watcher::begin() {
  memory_ = instance_->memory();
  node_.reset();
  node_.emplace(options_.caller.name, options_.node);
  sources_.clear();
  gone_.clear();
  strangers_.clear();
  pages_of_newcomers_ = pages_of_ids_ = 0;
  had_all_ = 0;
  begun_ = shm::monotonic_now();
  ports_ = OpenPorts(begun_);
  refusals_.clear();
  may_not_observe_ = false;
  next_question_ = 0;
  instance_->catch_up();
  const auto model = watch::ModelInForce::fetch(*instance_);
  generation_ = model.generation();
  opened_.clear();
  Batch taps;
  for (const std::string& source : chosen_sources(model)) open_tap(source, taps);
  const bool has_tap = std::any_of(sources_.begin(), sources_.end(),
                                   [](const auto& each) { return each.second.tap != nullptr; });
  if (options_.ports.empty()) had_all_ = begun_;
  const std::vector<std::string> refused = take_refusals();
  if (!has_begun_ && !has_tap && !refused.empty()) throw Error(refused.front());
  has_begun_ = true;
  for (const std::string& text : refused) options_.say(text);
  Batch states;
  for (auto& [source, watched] : sources_) {
    if (instance_->find_source(source)) add_page_state(source, states);
  }
  Batch start;
  start.is_start = true;
  start.add(
      evidence::Start{shm::monotonic_now(), instance_->name(), options_.ports, options_.payloads});
  for (RecordPtr& record : states.records) start.records.push_back(std::move(record));
  for (RecordPtr& record : taps.records) start.records.push_back(std::move(record));
  start.add(model_change(model));
  hand_over_start(std::move(start));
  try {
    look_at_ports();
  } catch (const std::exception&) {  // the daemon is busy: at the next look
  }
}

void Watcher::hand_over_start(Batch&& start) {
  {
    const std::lock_guard lock(mutex_);
    new_taps_ = {};
    to_start_.push_back(std::move(start));
  }
  hand_over_taps();
}

void Watcher::hand_over_taps() {
  const std::lock_guard lock(mutex_);
  for (auto& tap : opened_) new_taps_.taps.push_back(std::move(tap));
  opened_.clear();
}

// The page is read once the tap is there.
void Watcher::open_tap(const std::string& source, Batch& batch) {
  Watched& watched = sources_[source];
  watched.id = instance_->find_source(source);
  const bool with_payloads =
      options_.payloads == "all" ||
      (options_.payloads != "none" && rules::matches(options_.payloads, source));
  TapOptions options;
  options.may_wait = false;
  options.max_held = with_payloads ? 1 : 0;
  try {
    require_descriptors();
    Tap<> tap = node_->tap(source, options);
    const ActivityWord word = page_word(watched.id);
    watched.seen = watched.reported = word;
    watched.tap = std::make_shared<TapReader>(std::move(tap), with_payloads, word);
    opened_.push_back(watched.tap);
    const bool is_late = had_all_ != 0 && watched.next_try == 0 && word != shm::kNeverActive;
    if (!is_late) return;
    batch.add(evidence::Missed{source, had_all_, shm::monotonic_now(), 1, 0,
                               evidence::Missed::Why::overtaken, kUnknownNumber});
  } catch (const Error& error) {
    const bool is_known = watched.next_try != 0;
    watched.pause = std::clamp(2 * watched.pause, kTryAgainAfter, kTryAgainAtLeastEvery);
    watched.next_try = shm::monotonic_now() + watched.pause;
    if (is_known) return;
    watched.seen = watched.reported = page_word(watched.id);
    refusals_.emplace_back(source, error.what());
    const Nanoseconds now = shm::monotonic_now();
    batch.add(
        evidence::Missed{source, now, now, 0, 0, evidence::Missed::Why::refused, error.what()});
  }
}

void Watcher::tap_newcomers(const std::set<std::string>& sources, Batch& batch) {
  for (const std::string& source : sources) {
    if (sources_.count(source) != 0) continue;
    open_tap(source, batch);
    if (instance_->find_source(source)) add_page_state(source, batch);
  }
  for (const std::string& text : take_refusals()) options_.say(text);
}

// Sources that are refused for the same reason, as by one line of a policy, share a sentence.
std::vector<std::string> Watcher::take_refusals() {
  std::map<std::string, std::pair<std::vector<std::string>, std::string>> by_reason;
  for (auto& [source, why] : std::exchange(refusals_, {})) {
    std::string reason = why;
    if (const auto at = reason.find(source); at != std::string::npos) {
      reason.erase(at, source.size());
    }
    auto& [sources, text] = by_reason[reason];
    if (sources.empty()) text = why;
    sources.push_back(source);
  }
  std::vector<std::string> texts;
  texts.reserve(by_reason.size());
  for (const auto& [reason, refused] : by_reason) {
    texts.push_back("cannot record " + rules::enumerate(refused.first) + ": " + refused.second);
  }
  return texts;
}

// One at a time, for each may take its while. What its tap tells first is its state.
void Watcher::try_refused() {
  if (!instance_->has_daemon()) return;
  const Nanoseconds now = shm::monotonic_now();
  const auto due = std::find_if(sources_.begin(), sources_.end(), [&](const auto& each) {
    return each.second.tap == nullptr && each.second.next_try <= now;
  });
  if (due == sources_.end()) return;
  Batch batch;
  open_tap(due->first, batch);
  if (!batch.records.empty()) push(std::move(batch));
  if (due->second.tap == nullptr) return;
  options_.say("recording " + due->first + " from here on");
  hand_over_taps();
}

// Those whose names came with pages.
void Watcher::add_known_sources(std::set<std::string>& sources) const {
  for (shm::SourceId id = 0; id < shm::kMaxSources; ++id) {
    const auto gone = gone_.find(id);
    const bool is_gone = gone != gone_.end() && gone->second == memory_->tables().pages().of(id);
    if (!is_gone && memory_->pages().knows(id)) sources.insert(memory_->source_name(id));
  }
}

// Sources that no model knew when watching began. Each has brought a page.
void Watcher::look_for_newcomers() {
  const std::uint64_t pages = memory_->pages().changes();
  if (pages == pages_of_newcomers_) return;
  std::set<std::string> all;
  add_known_sources(all);
  Batch batch;
  tap_newcomers(all, batch);
  pages_of_newcomers_ = pages;
  if (batch.records.empty()) return;
  push(std::move(batch));
  hand_over_taps();
}

void Watcher::look_once_more() {
  look_at_pages();  // the daemon may be silent
  try {
    if (!instance_->has_daemon()) return;
    instance_->catch_up();
    last_ports_ = 0;
    look();
    hear_what_was_told();
  } catch (const std::exception&) {  // it does not answer, or refuses
  }
}

// The node is told in order: behind an answer to it, it has heard all that was said before.
void Watcher::hear_what_was_told() {
  const auto is_quiet = [](const auto& each) {  // no publisher is asked for it
    return each.second.tap != nullptr && !each.second.tap->polled().is_live;
  };
  auto any = std::find_if(sources_.begin(), sources_.end(), is_quiet);
  if (any == sources_.end()) any = sources_.begin();
  if (memory_ == nullptr || any == sources_.end()) return;
  TapOptions options;
  options.may_wait = false;
  options.max_held = 0;
  static_cast<void>(node_->tap(any->first, options));
}

}  // namespace arbiter::recorder
