// A change of the model that is under way.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "service/log/findings.hpp"
#include "service/models/change_queue.hpp"
#include "service/models/history.hpp"
#include "service/models/library.hpp"
#include "service/policy/policy.hpp"

namespace arbiter::service {

// From when the change is prepared until those who asked are answered.
struct Swap {
  Change change;
  Findings findings;
  LoadedModel to;
  std::string how;               // as in the history
  std::uint64_t content = 0;     // likewise
  std::string changes = "null";  // of what was in force before: as Reading::changes
  // Of a rollback: to where.
  std::optional<PastModel> back_to{};
  // Of a reload: what else changes with it.
  std::optional<Library> library{};
  std::optional<Policy> policy{};
  bool changes_policy = false;  // it has other rules than the one before
  // Of a switch: to what is in force.
  bool is_in_force_already = false;
};

}  // namespace arbiter::service
