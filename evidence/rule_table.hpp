// A decision table with the names that its numbers stand for: of a live instance, or made of a
// model's texts. One of a live instance is overwritten when seven more models have been loaded;
// what is read of it then is bounded, and wrong.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <unordered_map>

#include "shm/decision_table.hpp"
#include "shm/ids.hpp"

namespace arbiter::evidence {

struct RuleTable {
  std::shared_ptr<const void> owner;  // of the table's memory
  shm::TableView table;
  std::unordered_map<std::string, shm::SourceId> sources;
  std::map<shm::PortId, std::string> ports;

  // shm::kNone: the model does not know it.
  [[nodiscard]] shm::SourceId source(const std::string& name) const {
    const auto found = sources.find(name);
    return found == sources.end() ? shm::kNone : found->second;
  }
};

}  // namespace arbiter::evidence
