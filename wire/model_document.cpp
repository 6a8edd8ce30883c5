#include "wire/model_document.hpp"

#include <nlohmann/json.hpp>

#include "wire/fields.hpp"

namespace arbiter::wire {

void describe(auto& field, Is<ModelFile> auto& of) {
  field("path", of.path);
  field("text", of.text);
}

void describe(auto& field, Is<PastTimeout> auto& of) {
  field.span("timeout_ns", of.timeout);
  field("until_ns", of.until);
  field("word", of.word);
}

void describe(auto& field, Is<OtherModel> auto& of) {
  field("name", of.name);
  field("ports", of.ports);
}

void describe(auto& field, Is<ModelDocument> auto& of) {
  field("generation", of.generation);
  field("name", of.name);
  field("how", of.how);
  field("by", of.by);
  field("as_loaded", of.as_loaded);
  field("in_force_since_ns", of.in_force_since);
  field("known", of.known);
  field("directory", of.directory);
  field("models", of.models);
  field("application", of.application);
  field("ports_since_ns", of.ports_since);
  field("timeouts_before", of.timeouts_before);
  field("others", of.others);
}

std::string write_model_document(const ModelDocument& document) {
  return FieldWriter::json_of(document).dump(-1, ' ', false,
                                             nlohmann::json::error_handler_t::replace);
}

ModelDocument read_model_document(std::string_view text) {
  return FieldReader::read_whole<ModelDocument>(text);
}

}  // namespace arbiter::wire
