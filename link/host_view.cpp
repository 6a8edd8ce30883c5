#include "link/host_view.hpp"

#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <utility>
#include <vector>

#include <arbiter/type.hpp>

#include "gateway/core/max_ages.hpp"
#include "gateway/core/turned_away.hpp"
#include "link/core/host_card.hpp"
#include "shm/clock.hpp"
#include "shm/port_picture.hpp"
#include "watch/imported.hpp"
#include "watch/picture.hpp"
#include "wire/document.hpp"
#include "wire/model_document.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::link {
namespace {

constexpr shm::Nanoseconds kMillisecond = 1'000'000;
constexpr shm::Nanoseconds kJoinPeriod = 500 * kMillisecond;
constexpr shm::Nanoseconds kAskPeriod = 250 * kMillisecond;
// The status of a large robot takes milliseconds to read: it is asked for less often, so that this
// takes one percent of a processor at most.
constexpr shm::Nanoseconds kLongestAskPeriod = 1000 * kMillisecond;
constexpr shm::Nanoseconds kTimesItsCost = 100;
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

// What this thread has used.
shm::Nanoseconds processor_time() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return shm::Nanoseconds{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

struct Wanted {
  std::uint64_t generation = 0;
  std::map<shm::SourceId, shm::Nanoseconds> ages;
  std::map<shm::SourceId, SourceUse> uses;
};

SourceUse use_in(const shm::TableView& table, shm::SourceId source) {
  if (table.connections_of_source(source).count == 0) return SourceUse::kSensed;
  return table.timeout(source) == shm::kForever ? SourceUse::kForever : SourceUse::kFinite;
}

// As a tap of the port says it.
shm::TypeInfo info_of(const wire::OpenOutput& open) {
  shm::TypeInfo info;
  info.size = open.max_size;
  info.alignment = Type::untyped(open.max_size).alignment();
  if (open.type) {
    info.set_name(open.type->name);
    info.alignment = open.type->alignment;
  }
  return info;
}

// Nothing: the table was torn.
std::optional<Wanted> read_table(const shm::TableReader& tables,
                                 const std::optional<shm::Nanoseconds>& max_age) {
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
          gateway::max_age_of(table.timeout(source), table.timeout(shm::kNone), max_age);
      wanted.uses[source] = use_in(table, source);
    }
    if (tables.is_whole(snapshot)) return wanted;
  }
  return std::nullopt;
}

// The name of the program that a process runs; empty: it is not to be seen from here.
std::string program_of(int process) {
  std::ifstream file("/proc/" + std::to_string(process) + "/comm");
  std::string name;
  std::getline(file, name);
  return name;
}

// Whether a link has it open. Any component may call itself so. A process that is not to be seen
// from here (another PID namespace) has nothing but that name; nor has a link that has just died,
// and one that is ending beside this one is known by its program.
bool is_link(const wire::Component& component) {
  if (component.node != watch::kLinkNode) return false;
  if (component.pid == ::getpid()) return true;
  const std::string program = program_of(component.pid);
  return program.empty() || program == program_of(::getpid());
}

// Of what was read, wherever the files lie.
std::uint64_t digest_of(const wire::ModelDocument& document) {
  if (!document.known) return 0;
  Digest digest;
  for (const wire::ModelFile& file : document.models) digest.add(file.text);
  digest.add(document.application ? document.application->text : "");
  return digest.value();
}

}  // namespace

HostView::HostView(std::string instance, std::optional<shm::Nanoseconds> max_age)
    : instance_name_(std::move(instance)), max_age_(max_age) {}

void HostView::update(const std::function<void()>& model_is_known) {
  try {
    if (instance_ == nullptr && !join()) return;
    instance_->update();
    look_at_model();
    model_is_known();
    look_at_ports();
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
  const std::optional<Wanted> wanted = read_table(instance_->memory()->tables(), max_age_);
  if (!wanted) return;  // at the next look
  wanted_.clear();
  for (const auto& [source, age] : wanted->ages) {
    wanted_[instance_->memory()->source_name(source)] = age;
  }
  uses_.clear();
  for (const auto& [source, use] : wanted->uses) {
    uses_[instance_->memory()->source_name(source)] = use;
  }
  memory_ = instance_->memory();
  generation_ = wanted->generation;
}

void HostView::look_at_ports() {
  const shm::Nanoseconds now = shm::monotonic_now();
  if (!instance_->has_daemon()) obstacle_.clear();  // it is no longer that which did not answer
  if (now < ask_again_ || !instance_->has_daemon()) return;
  const shm::Nanoseconds before_it = processor_time();
  const wire::Status status = ask_status(now);
  const shm::Nanoseconds cost = processor_time() - before_it;
  ask_again_ = now + std::clamp(kTimesItsCost * cost, kAskPeriod, kLongestAskPeriod);
  OpenPorts open;
  for (const wire::SourceStatus& source : status.sources) {
    const bool is_ours = source.open && is_link(source.open->component);
    if (source.open && !is_ours) open[source.name] = info_of(*source.open);
    // A component that has not come back to this daemon yet has what it had: samples go on.
    const auto before = open_here_.find(source.name);
    if (source.away_pid && before != open_here_.end()) open[source.name] = before->second;
  }
  open_here_ = std::move(open);
  std::set<std::string, std::less<>> inputs;
  for (const wire::InputStatus& input : status.inputs) {
    const bool is_back_soon = input.away_pid && inputs_here_.contains(input.name);
    if (input.open || is_back_soon) inputs.insert(input.name);
  }
  inputs_here_ = std::move(inputs);
  const auto turned_away = gateway::turned_away_at(status, watch::kLinkNode);
  if (turned_away) turned_away_ = std::max(turned_away_, *turned_away);
  know_model(status.model);
  obstacle_.clear();
}

// Who has waited in vain lets the loop go round for as long before it asks again.
wire::Status HostView::ask_status(shm::Nanoseconds now) {
  try {
    return instance_->status();
  } catch (...) {
    const shm::Nanoseconds after = shm::monotonic_now();
    ask_again_ = after + std::max(after - now, kAskPeriod);
    throw;
  }
}

// Its texts are asked for once. A daemon that is new may have another model of the same generation.
void HostView::know_model(const wire::ModelStatus& model) {
  const bool is_known = model.generation == model_.generation &&
                        model.name.value_or("") == model_.name &&
                        model_of_daemon_ == instance_->daemons();
  if (is_known) return;
  Model now{model.generation, model.name.value_or(""), 0};
  if (now.generation != 0) {
    wire::Message question;
    question.kind = wire::MessageKind::kModel;
    const auto answer = instance_->ask(question);
    now.digest = digest_of(wire::read_model_document(wire::read_document(answer.descriptors[0])));
  }
  model_ = std::move(now);
  model_of_daemon_ = instance_->daemons();
}

SourceUse HostView::use_of(const std::string& source) const {
  const auto found = uses_.find(source);
  return found == uses_.end() ? SourceUse::kNone : found->second;
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
