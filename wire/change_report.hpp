// What came of a change of the model: the report on a reload, a switch, a rollback or a dry run.
//
// docs/changing-models.md says what each field means.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "wire/messages.hpp"
#include "wire/status.hpp"

namespace arbiter::wire {

// Of a port that is decided differently.
struct PortDifference {
  struct Side {
    bool exists = false;  // the model mentions the port
  };
  std::string port;
  Side after;
};

struct ModelDifference {
  std::vector<PortDifference> ports;
};

// What is decided differently.
struct ModelChanges {
  std::string summary;  // a line
  std::string text;     // as `arbiter diff` writes it
  std::optional<ModelDifference> diff;
};

// One model, in a dry run.
struct ModelComparison {
  std::string name;
  bool in_force = false;
  std::optional<ModelChanges> changes;  // none: not compared
};

// The policy, as its file was read.
struct PolicyComparison {
  std::string file;  // from the root
  std::uint64_t rules = 0;
  bool differs = false;  // from what was in force before
};

struct ChangeReport {
  bool ok = false;
  bool has_errors = false;         // files have; the text says which
  std::string text;                // what was found in files, for people
  std::optional<std::string> why;  // it is refused
  // Of what is in force now.
  std::optional<std::uint64_t> generation;
  std::optional<bool> already;                         // of a switch: it was in force before
  std::optional<PastModelStatus> back_to;              // a rollback
  std::optional<ModelChanges> changes;                 // none: not compared
  std::optional<std::vector<ModelComparison>> models;  // of a dry run
  std::optional<PolicyComparison> policy;              // of a reload and a dry run
};

// Throws DocumentError.
[[nodiscard]] ChangeReport read_change_report(std::string_view text);

// What a daemon answered that was asked for a report (kWantsReport), as JSON: one that has no
// descriptor left for it says kDone instead, and that makes a report, too. Throws DocumentError.
[[nodiscard]] std::string change_report_text(const Received& answer);

}  // namespace arbiter::wire
