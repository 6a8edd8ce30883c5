// A model that was in force: of the history in the status document, and of the report on a change.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace arbiter::wire {

struct PastModelStatus {
  std::uint64_t generation = 0;
  std::uint64_t content = 0;  // the first generation with the same content
  std::string name;
  std::vector<std::string> files;
  std::optional<std::string> application;
  std::int64_t since_ms = 0;  // since 1970
  std::string how;
  std::optional<std::string> by;
  std::optional<std::string> changes;
  bool is_kept = false;
};

}  // namespace arbiter::wire
