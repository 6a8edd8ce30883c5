// Lays a compiled model out as the words of shm/decision_table.hpp.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "rules/prove/compiled_model.hpp"
#include "shm/decision_table.hpp"
#include "shm/ids.hpp"

namespace arbiter::rules {

// The ids under which a table names sources and ports; each must be below the limits of the table.
struct TableIds {
  std::function<shm::SourceId(const std::string& source)> source;
  std::function<shm::PortId(const std::string& port)> port;
};

// How many words a table of the model can have at most, whatever the ids. compile() makes sure that
// it is within kMaxTableWords, so that what a check has accepted can be loaded.
std::size_t largest_table(const CompiledModel& model);

// The words of shm/decision_table.hpp. Throws std::length_error where kMaxTableWords is exceeded.
std::vector<shm::Word> flatten(const CompiledModel& model, const TableIds& ids);

}  // namespace arbiter::rules
