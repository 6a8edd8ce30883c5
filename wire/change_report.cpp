#include "wire/change_report.hpp"

#include <nlohmann/json.hpp>

#include "wire/document.hpp"
#include "wire/fields.hpp"
#include "wire/past_model_fields.hpp"

namespace arbiter::wire {

void describe(auto& field, Is<PortDifference::Side> auto& of) { field("exists", of.exists); }

void describe(auto& field, Is<PortDifference> auto& of) {
  field("port", of.port);
  field("after", of.after);
}

void describe(auto& field, Is<ModelDifference> auto& of) { field("ports", of.ports); }

void describe(auto& field, Is<ModelChanges> auto& of) {
  field("summary", of.summary);
  field("text", of.text);
  field.maybe("diff", of.diff);
}

void describe(auto& field, Is<ModelComparison> auto& of) {
  field("name", of.name);
  field("in_force", of.in_force);
  field("changes", of.changes);
}

void describe(auto& field, Is<PolicyComparison> auto& of) {
  field("file", of.file);
  field("rules", of.rules);
  field("differs", of.differs);
}

void describe(auto& field, Is<ChangeReport> auto& of) {
  field("ok", of.ok);
  field("has_errors", of.has_errors);
  field("text", of.text);
  field.maybe("why", of.why);
  field.maybe("generation", of.generation);
  field.maybe("already", of.already);
  field.maybe("back_to", of.back_to);
  field.maybe("changes", of.changes);
  field.maybe("models", of.models);
  field.maybe("policy", of.policy);
}

ChangeReport read_change_report(std::string_view text) {
  return FieldReader::read_whole<ChangeReport>(text);
}

std::string change_report_text(const Received& answer) {
  if (answer.message.kind != MessageKind::kDone) return read_document(answer.descriptors[0]);
  return write_document({{"ok", true},
                         {"has_errors", false},
                         {"findings", nlohmann::json::array()},
                         {"text", "the daemon had no descriptor left for its report\n"},
                         {"generation", answer.message.value}});
}

}  // namespace arbiter::wire
