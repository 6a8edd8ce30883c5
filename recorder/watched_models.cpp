// Which model is in force, and which sources it makes the recorder watch.
#include <algorithm>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "recorder/watcher.hpp"
#include "rules/model/quantifiers.hpp"
#include "shm/clock.hpp"
#include "shm/port_picture.hpp"

namespace arbiter::recorder {
namespace {

// A model that is replaced while it is asked for is asked for again.
constexpr int kTries = 100;

std::vector<evidence::ModelFile> files_of(const std::vector<rules::FileText>& texts) {
  std::vector<evidence::ModelFile> files;
  files.reserve(texts.size());
  for (const rules::FileText& text : texts) files.push_back({text.path, text.content});
  return files;
}

}  // namespace

// With its sources: what arrives at them from here on is recorded. The model's own record comes
// first, so that decisions under it find it.
void Watcher::take_up_model() {
  for (int i = 0; i < kTries; ++i) {
    instance_->catch_up();
    const auto model = watch::ModelInForce::fetch(*instance_);
    if (model.generation() != memory_->tables().generation()) continue;
    generation_ = model.generation();
    Batch batch;
    batch.add(model_change(model));
    tap_newcomers(chosen_sources(model), batch);
    push(std::move(batch));
    hand_over_taps();
    return;
  }
}

bool Watcher::is_chosen(const std::string& port) const {
  return options_.ports.empty() ||
         std::any_of(options_.ports.begin(), options_.ports.end(),
                     [&](const std::string& pattern) { return rules::matches(pattern, port); });
}

// All that the chosen ports are connected to or read: under the model in force, and under those
// that may be switched to.
std::set<std::string> Watcher::chosen_sources(const watch::ModelInForce& model) {
  named_.clear();
  const auto snapshot = memory_->tables().snapshot();
  const auto add_source = [&](shm::SourceId id) {
    if (memory_->pages().knows(id)) named_.insert(memory_->source_name(id));
  };
  for (const auto& [id, name] : instance_->port_names()) {
    if (is_chosen(name)) shm::for_each_heeded(snapshot.table, id, add_source);
  }
  for (const auto& other : model.others()) {
    for (const auto& [port, sources] : other.ports) {
      if (is_chosen(port)) named_.insert(sources.begin(), sources.end());
    }
  }
  std::set<std::string> chosen = named_;
  if (options_.ports.empty()) add_known_sources(chosen);
  return chosen;
}

evidence::ModelChange Watcher::model_change(const watch::ModelInForce& model) const {
  evidence::ModelChange change;
  change.time = model.since();
  change.seen = shm::monotonic_now();
  change.generation = model.generation();
  change.name = model.name().value_or("");
  change.how = model.how().value_or("");
  change.by = model.by().value_or("");
  change.has_texts = model.has_texts();
  change.files = files_of(model.texts().models);
  if (const auto& application = model.texts().application) {
    change.application = {application->path, application->content};
  }
  if (!model.is_none()) change.table = rule_table();
  return change;
}

std::shared_ptr<const evidence::RuleTable> Watcher::rule_table() const {
  auto rules = std::make_shared<evidence::RuleTable>();
  rules->owner = memory_;
  rules->table = memory_->tables().snapshot().table;
  for (shm::SourceId id = 0; id < rules->table.source_count(); ++id) {
    if (!rules->table.knows_source(id) || !memory_->pages().knows(id)) continue;
    rules->sources[memory_->source_name(id)] = id;
  }
  for (const auto& [id, name] : instance_->port_names()) {
    if (rules->table.knows_port(id) && is_chosen(name)) rules->ports[id] = name;
  }
  return rules;
}

}  // namespace arbiter::recorder
