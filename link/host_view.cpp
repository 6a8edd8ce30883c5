#include "link/host_view.hpp"

#include <optional>
#include <utility>
#include <vector>

#include "gateway/core/max_ages.hpp"
#include "shm/clock.hpp"
#include "shm/picture.hpp"
#include "watch/picture.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::link {
namespace {

constexpr shm::Nanoseconds kMillisecond = 1'000'000;
constexpr shm::Nanoseconds kJoinPeriod = 500 * kMillisecond;
constexpr shm::Nanoseconds kAskPeriod = 250 * kMillisecond;
// Torn tables are read again; seven models in one reading are nobody's.
constexpr int kMaxTries = 4;

wire::Caller caller_of(const std::string& instance) {
  wire::Caller caller;
  caller.name = "arbiter-link-watch";
  caller.instance = wire::instance_name(instance);
  caller.patience = std::chrono::milliseconds(1);
  caller.answer_time = std::chrono::milliseconds(1000);
  return caller;
}

struct Wanted {
  std::uint64_t generation = 0;
  std::map<shm::SourceId, shm::Nanoseconds> ages;
};

std::optional<shm::TypeInfo> info_of(const std::optional<wire::SampleType>& type) {
  if (!type) return std::nullopt;
  shm::TypeInfo info;
  info.set_name(type->name);
  info.size = type->size;
  info.alignment = type->alignment;
  return info;
}

// Nothing: the table was torn.
std::optional<Wanted> read_table(const shm::TableReader& tables) {
  for (int tries = 0; tries < kMaxTries; ++tries) {
    const shm::TableSnapshot snapshot = tables.snapshot();
    Wanted wanted;
    wanted.generation = snapshot.generation;
    if (snapshot.generation == 0) return wanted;
    const shm::TableView& table = snapshot.table;
    for (const shm::SourceId source : watch::all_sources(table)) {
      const bool is_used = table.connections_of_source(source).count != 0 ||
                           table.ports_concerned(source).count != 0;
      if (!is_used) continue;  // only declared
      wanted.ages[source] =
          gateway::max_age_of(table.timeout(source), table.timeout(shm::kNone), std::nullopt);
    }
    if (tables.is_whole(snapshot)) return wanted;
  }
  return std::nullopt;
}

}  // namespace

HostView::HostView(std::string instance) : instance_name_(std::move(instance)) {}

void HostView::update() {
  try {
    if (instance_ == nullptr && !join()) return;
    instance_->update();
    look_at_model();
    look_at_ports();
    obstacle_.clear();
  } catch (const std::exception& error) {  // no daemon, a policy, memory that is short
    obstacle_ = error.what();
  }
}

bool HostView::join() {
  const shm::Nanoseconds now = shm::monotonic_now();
  if (now < join_again_) return false;
  join_again_ = now + kJoinPeriod;
  instance_ = std::make_unique<watch::Instance>(caller_of(instance_name_));
  return true;
}

void HostView::look_at_model() {
  const auto& memory = instance_->memory();
  const std::uint64_t generation = memory->tables().snapshot().generation;
  if (memory == memory_ && generation == generation_) return;
  instance_->catch_up();  // all names that the model has
  const std::optional<Wanted> wanted = read_table(instance_->memory()->tables());
  if (!wanted) return;  // at the next look
  wanted_.clear();
  for (const auto& [source, age] : wanted->ages) {
    wanted_[instance_->memory()->source_name(source)] = age;
  }
  memory_ = instance_->memory();
  generation_ = wanted->generation;
}

void HostView::look_at_ports() {
  const shm::Nanoseconds now = shm::monotonic_now();
  if (now < ask_again_ || !instance_->has_daemon()) return;
  ask_again_ = now + kAskPeriod;
  const wire::Status status = instance_->status();
  OpenPorts open;
  for (const wire::SourceStatus& source : status.sources) {
    const bool is_ours = source.open && source.open->component.node == kNodeName;
    if (source.open && !is_ours) open[source.name] = info_of(source.open->type);
    // A component that has not come back to this daemon yet has what it had: samples go on.
    const auto before = open_here_.find(source.name);
    if (source.away_pid && before != open_here_.end()) open[source.name] = before->second;
  }
  open_here_ = std::move(open);
}

bool HostView::is_deactivated(const std::string& source) const {
  if (instance_ == nullptr) return false;
  const auto id = instance_->find_source(source);
  if (!id) return false;
  // One word, which needs no model to be read by.
  shm::Sight sight{*id, instance_->memory()->pages().find(*id), {}};
  sight.look();
  return sight.activity != nullptr && shm::is_deactivation(sight.seen.word);
}

}  // namespace arbiter::link
