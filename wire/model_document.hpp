// The model document: the texts of the model in force, and what it was before.
//
// docs/protocol.md says what each field means; model_document.cpp names them once.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "shm/activity.hpp"

namespace arbiter::wire {

struct ModelFile {
  std::string path;  // as the daemon was given it
  std::string text;
};

// What T of a source was under the model before.
struct PastTimeout {
  shm::Nanoseconds timeout = 0;
  shm::Nanoseconds until = 0;                  // CLOCK_MONOTONIC
  shm::ActivityWord word = shm::kNeverActive;  // the activity then
};

// A model that is loaded and not in force.
struct OtherModel {
  std::string name;
  std::map<std::string, std::vector<std::string>> ports;  // by input port: its sources
};

struct ModelDocument {
  std::uint64_t generation = 0;  // 0: no model is in force
  std::optional<std::string> name;
  std::optional<std::string> how;
  std::optional<std::string> by;
  std::optional<bool> as_loaded;
  shm::Nanoseconds in_force_since = 0;  // CLOCK_MONOTONIC; 0: since before this daemon
  bool known = false;                   // the daemon has its texts
  std::string directory;                // that relative paths start from
  std::vector<ModelFile> models;
  std::optional<ModelFile> application;
  std::map<std::string, shm::Nanoseconds> ports_since;  // each port is decided as it is
  std::map<std::string, PastTimeout> timeouts_before;
  std::vector<OtherModel> others;
};

// Text that is not UTF-8 is replaced.
[[nodiscard]] std::string write_model_document(const ModelDocument& document);
// Throws DocumentError.
[[nodiscard]] ModelDocument read_model_document(std::string_view text);

}  // namespace arbiter::wire
