// The model in force as the daemon has it: what it is called, since when and by whom it is in
// force, its texts, and what it was before.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "rules/model/model_texts.hpp"
#include "shm/activity.hpp"
#include "wire/model_document.hpp"

namespace arbiter::watch {

class Instance;

// A file of the model, as it is by now.
struct FileNow {
  enum class State : std::uint8_t { kSame, kChanged, kGone, kUnreadable };
  std::string path;
  State state = State::kSame;
};

class ModelInForce {
 public:
  // No model.
  ModelInForce() = default;
  explicit ModelInForce(wire::ModelDocument document);
  // Throws wire::CallError, wire::DocumentError.
  static ModelInForce fetch(Instance& instance);

  [[nodiscard]] std::uint64_t generation() const { return document_.generation; }
  [[nodiscard]] bool is_none() const { return document_.generation == 0; }
  [[nodiscard]] const std::optional<std::string>& name() const { return document_.name; }
  // "reload", "switch", …, and who asked for it.
  [[nodiscard]] const std::optional<std::string>& how() const { return document_.how; }
  [[nodiscard]] const std::optional<std::string>& by() const { return document_.by; }
  // The daemon knows its texts, and not only its decisions.
  [[nodiscard]] bool has_texts() const { return document_.known; }
  // Their paths are such as a reader in the directory where this program runs can open.
  [[nodiscard]] const rules::ModelTexts& texts() const { return texts_; }

  // CLOCK_MONOTONIC; 0: since before this daemon came.
  [[nodiscard]] shm::Nanoseconds since() const { return document_.in_force_since; }
  // Since when the port is decided as it is; earlier than that where the model before did the same.
  [[nodiscard]] shm::Nanoseconds since(const std::string& port) const;
  // Nothing where the source's T has always been the one that it is.
  [[nodiscard]] std::optional<wire::PastTimeout> timeout_before(const std::string& source) const;

  // `model 2 "work" (work.xml)`, `no model`.
  [[nodiscard]] std::string text() const;

  // What has become of the files that were read. Looks at them.
  [[nodiscard]] std::vector<FileNow> files_now() const;
  // The files were read again after it: it has been rolled back to.
  [[nodiscard]] bool is_older() const { return document_.as_loaded == false; }

  // The models that could be switched to.
  [[nodiscard]] const std::vector<wire::OtherModel>& others() const { return document_.others; }
  // Of these, the first that connects something to the port, or that
  // source if one is given.
  [[nodiscard]] std::optional<std::string> other_that_mentions(
      const std::string& port, const std::optional<std::string>& source = {}) const;

 private:
  wire::ModelDocument document_;  // without its texts
  rules::ModelTexts texts_;
};

// A path that the daemon has been given, which runs in `directory`: relative where it lies below
// the directory in which this program runs, else absolute.
[[nodiscard]] std::string path_from_here(const std::string& path, const std::string& directory);

}  // namespace arbiter::watch
