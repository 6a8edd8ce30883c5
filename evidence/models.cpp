#include "evidence/models.hpp"

#include <utility>

namespace arbiter::evidence {

rules::ModelTexts texts_of(const ModelChange& model) {
  rules::ModelTexts texts;
  for (const ModelFile& file : model.files) texts.models.push_back({file.path, file.text});
  if (model.application) texts.application = {model.application->path, model.application->text};
  return texts;
}

Judge* Models::judge(const Run& run, std::uint64_t generation) {
  const auto model = run.models.find(generation);
  if (model == run.models.end() || !model->second.has_texts) return nullptr;
  std::unique_ptr<Judge>& judge = judges_[&model->second];
  if (judge == nullptr) judge = std::make_unique<Judge>(compile_(texts_of(model->second)), false);
  return judge.get();
}

std::shared_ptr<const RuleTable> rule_table_of(const rules::Simulation& simulation) {
  auto rules = std::make_shared<RuleTable>();
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
