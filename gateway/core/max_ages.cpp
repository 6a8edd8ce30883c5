#include "gateway/core/max_ages.hpp"

#include <algorithm>
#include <exception>
#include <utility>

#include "gateway/core/turned_away.hpp"
#include "shm/clock.hpp"
#include "shm/segment.hpp"
#include "wire/call.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::gateway {
namespace {

// After a daemon did not let us in.
constexpr shm::Nanoseconds kJoinInterval = 1'000'000'000;
constexpr shm::Nanoseconds kAskInterval = 1'000'000'000;
// Torn tables are read again; seven models in one reading are nobody's.
constexpr int kMaxTries = 4;

wire::Caller caller_of(const std::string& instance) {
  wire::Caller caller;
  caller.name = "arbiter-gateway-watch";
  caller.instance = wire::instance_name(instance);
  // It is asked for from the loop, which must not wait for long.
  caller.patience = std::chrono::milliseconds(1);
  caller.answer_time = std::chrono::milliseconds(100);
  return caller;
}

}  // namespace

shm::Nanoseconds max_age_of(shm::Nanoseconds timeout, shm::Nanoseconds of_model,
                            const std::optional<shm::Nanoseconds>& max_age) {
  if (timeout != shm::kForever) return max_age ? std::min(timeout, *max_age) : timeout;
  if (max_age) return *max_age;
  return of_model != shm::kForever ? of_model : shm::kDefaultTimeout;
}

MaxAges::MaxAges(std::string instance) : instance_name_(std::move(instance)) {}

void MaxAges::add(const Entry& entry, MaxAge& age) {
  watched_.push_back({&entry, &age});
  update();
}

bool MaxAges::update() {
  if (instance_ == nullptr) {
    join();
  } else {
    try {
      instance_->update();
      obstacle_.clear();
    } catch (const std::exception& error) {  // memory or descriptors are short
      obstacle_ = error.what();
    }
  }
  // Before they are read: what comes in between is found the next time.
  const shm::Epoch before = epoch_;
  if (instance_ != nullptr) epoch_ = instance_->memory()->tables().epoch();
  bool has_changed = epoch_ != before;
  for (const Watched& each : watched_) {
    const auto ports = each.entry->ports();
    MaxAge::OfPorts ages{};
    bool is_forever = !each.entry->max_age;
    for (std::size_t i = 0; i < ages.size(); ++i) {
      const Timeouts timeouts = timeouts_of(ports[std::min(i, ports.size() - 1)]->name);
      ages[i] = max_age_of(timeouts.own, timeouts.of_model, each.entry->max_age);
      is_forever = is_forever && timeouts.own == shm::kForever;
    }
    const bool is_known = instance_ != nullptr;
    has_changed =
        has_changed || each.age->is_forever() != is_forever || each.age->is_known() != is_known;
    each.age->set(ages, is_forever, is_known);
  }
  return has_changed;
}

bool MaxAges::is_outdated() const {
  return instance_ != nullptr && instance_->memory()->tables().epoch() != epoch_;
}

void MaxAges::join() {
  const shm::Nanoseconds now = shm::monotonic_now();
  if (now < join_again_) return;
  join_again_ = now + kJoinInterval;
  try {
    instance_ = std::make_unique<watch::Instance>(caller_of(instance_name_));
    first_ = instance_->memory();
    obstacle_.clear();
  } catch (const std::exception& error) {
    obstacle_ = error.what();
  }
}

bool MaxAges::has_other_memory() const {
  if (instance_ == nullptr || !instance_->has_daemon()) return false;
  const auto& now = instance_->memory();
  return now != first_ && !shm::are_one_segment(now->board(), first_->board());
}

bool MaxAges::is_turned_away(std::string_view node) {
  const shm::Nanoseconds now = shm::monotonic_now();
  if (now < ask_again_ || !has_other_memory()) return false;
  ask_again_ = now + kAskInterval;
  try {
    return turned_away_at(instance_->status(), node).has_value();
  } catch (const std::exception&) {  // it does not answer: another time
    return false;
  }
}

shm::Nanoseconds MaxAges::of(std::string_view source) const {
  const Timeouts timeouts = timeouts_of(source);
  return max_age_of(timeouts.own, timeouts.of_model, {});
}

MaxAges::Timeouts MaxAges::timeouts_of(std::string_view source) const {
  if (instance_ == nullptr) return {};
  const auto id = instance_->find_source(source);
  const shm::TableReader& tables = instance_->memory()->tables();
  for (int tries = 0; tries < kMaxTries; ++tries) {
    const shm::TableSnapshot snapshot = tables.snapshot();
    if (snapshot.generation == 0) break;
    const Timeouts read{snapshot.table.timeout(id.value_or(shm::kNone)),
                        snapshot.table.timeout(shm::kNone)};
    if (tables.is_whole(snapshot)) return read;
  }
  return {};
}

}  // namespace arbiter::gateway
