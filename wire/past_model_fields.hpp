// The fields of a model that was in force, which stand in two documents.
#pragma once

#include "wire/fields.hpp"
#include "wire/past_model.hpp"

namespace arbiter::wire {

void describe(auto& field, Is<PastModelStatus> auto& of) {
  field("generation", of.generation);
  field("content", of.content);
  field("name", of.name);
  field("files", of.files);
  field("application", of.application);
  field("since_ms", of.since_ms);
  field("how", of.how);
  field("by", of.by);
  field("changes", of.changes);
  field("is_kept", of.is_kept);
}

}  // namespace arbiter::wire
