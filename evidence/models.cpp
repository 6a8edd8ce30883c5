#include "evidence/models.hpp"

#include <cstddef>
#include <utility>

namespace arbiter::evidence {
namespace {

// Decisions come by time, so that few of those before are asked for again.
constexpr std::size_t kMostJudges = 16;

}  // namespace

rules::ModelTexts texts_of(const ModelChange& model) {
  rules::ModelTexts texts;
  for (const ModelFile& file : model.files) texts.models.push_back({file.path, file.text});
  if (model.application) texts.application = {model.application->path, model.application->text};
  return texts;
}

std::shared_ptr<Judge> Models::judge(const Run& run, std::uint64_t generation) {
  const auto model = run.models.find(generation);
  if (model == run.models.end() || !model->second.has_texts) return nullptr;
  const auto known = judges_.find(&model->second);
  if (known != judges_.end()) return known->second;
  if (judges_.size() == kMostJudges) judges_.clear();
  auto judge = std::make_shared<Judge>(compile_(texts_of(model->second)), false);
  return judges_[&model->second] = std::move(judge);
}

std::shared_ptr<const RuleTable> rule_table_of(const rules::Simulation& simulation,
                                               std::shared_ptr<const void> owner) {
  auto rules = std::make_shared<RuleTable>();
  rules->owner = std::move(owner);
  rules->table = simulation.table();
  for (std::size_t id = 0; id < simulation.source_count(); ++id) {
    const auto source = static_cast<shm::SourceId>(id);
    rules->sources.emplace(simulation.source_name(source), source);
  }
  for (std::size_t id = 0; id < simulation.port_names().size(); ++id) {
    rules->ports.emplace(static_cast<shm::PortId>(id), simulation.port_names()[id]);
  }
  return rules;
}

}  // namespace arbiter::evidence
