// Which models have been in force: what `arbiter history` shows, and a rollback goes back to.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "service/models/library.hpp"
#include "wire/status.hpp"

namespace arbiter::service {

// How a model came into force that a predecessor had in force.
inline constexpr char kInherited[] = "takeover";

// One that came into force.
struct PastModel {
  std::uint64_t generation = 0;
  // The first generation whose content this is, be it in the history or not any longer; another
  // for a rollback, and for a reload or a switch that changed nothing.
  std::uint64_t content = 0;
  std::string name;
  rules::ModelFiles files;
  std::int64_t since_ms = 0;  // as calendar_ms()
  std::string how;            // "start", "takeover", "reload", "switch", "rollback to 3"
  std::string by;             // who asked; empty: nobody
  std::string changes;        // what decides differently than before; empty: not compared
  ModelPointer model;         // null: not kept any longer, or a predecessor's
};

// As the status document has it.
[[nodiscard]] wire::PastModelStatus status_of(const PastModel& entry);
[[nodiscard]] nlohmann::json to_json(const PastModel& entry);

// The calendar's time, in milliseconds since 1970.
[[nodiscard]] std::int64_t calendar_ms();

class History {
 public:
  static constexpr std::size_t kMaxEntries = 16;
  // Of the models in it. The latest is kept whatever its size; older ones as they fit.
  static constexpr std::size_t kMaxBytes = std::size_t{64} << 20;

  explicit History(std::size_t max_bytes = kMaxBytes) : max_bytes_(max_bytes) {}

  void add(PastModel entry);
  // What has changed is told once it is known.
  void set_changes(std::uint64_t generation, const std::string& changes);

  // Null where it is empty.
  [[nodiscard]] const PastModel* latest() const {
    return models_.empty() ? nullptr : &models_.back();
  }
  [[nodiscard]] const PastModel* find(std::uint64_t generation) const;
  // Where a rollback goes that names no generation: to what was in force before the latest; after
  // a rollback one step further back. Null: nowhere.
  [[nodiscard]] const PastModel* previous() const;
  // Whether all that was in force before that content of the latest was a predecessor's, be it in
  // the history or not any longer.
  [[nodiscard]] bool begins_with_predecessor() const;
  // The latest first.
  [[nodiscard]] std::vector<wire::PastModelStatus> status() const;

 private:
  void forget_what_does_not_fit();

  std::size_t max_bytes_;
  std::deque<PastModel> models_;  // the oldest first
  bool has_inherited_ = false;
  std::uint64_t first_own_ = UINT64_MAX;  // generation that no predecessor had in force
};

}  // namespace arbiter::service
