// The model in force as the daemon has it: what it is called, since when and by whom it is in
// force, its texts, and what it was before.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "client/node_core.hpp"
#include "rules/model/model_texts.hpp"
#include "shm/activity.hpp"

namespace arbiter::cli {

// A file of the model, as it is by now.
struct FileNow {
  enum class State : std::uint8_t { kSame, kChanged, kGone, kUnreadable };
  std::string path;
  State state = State::kSame;
};

class ModelInForce {
 public:
  struct PastTimeout {
    shm::Nanoseconds timeout = 0;  // T until then
    shm::Nanoseconds until = 0;
    shm::ActivityWord word = shm::kNeverActive;  // what the activity was then
  };

  ModelInForce() = default;
  // Throws Error.
  static ModelInForce fetch(detail::NodeCore& node);

  [[nodiscard]] std::uint64_t generation() const { return generation_; }
  [[nodiscard]] bool is_none() const { return generation_ == 0; }
  // The daemon knows its texts, and not only its decisions.
  [[nodiscard]] bool has_texts() const { return has_texts_; }
  // Their paths are such as the reader, in the directory where this program runs, can open.
  [[nodiscard]] const rules::ModelTexts& texts() const { return texts_; }

  // 0: not known.
  [[nodiscard]] shm::Nanoseconds since() const { return since_; }
  // Since when the port is decided as it is; earlier than that where the model before did the same.
  [[nodiscard]] shm::Nanoseconds since(const std::string& port) const;
  // Nothing where the source's T has always been the one that it is.
  [[nodiscard]] std::optional<PastTimeout> timeout_before(const std::string& source) const;

  // `model 2 "work" (work.xml)`, `no model`.
  [[nodiscard]] std::string text() const;
  // " (switch, by node …)", empty where it is not known.
  [[nodiscard]] std::string how_text() const;
  // ", in force since 3.2 s ago (switch, by node …)"
  [[nodiscard]] std::string origin_text(shm::Nanoseconds now) const;
  [[nodiscard]] nlohmann::json to_json() const;

  // What has become of the files that were read. Looks at them.
  [[nodiscard]] std::vector<FileNow> files_now() const;
  // The files were read again after it: it has been rolled back to.
  [[nodiscard]] bool is_older() const { return is_older_; }

  // Of the models that could be switched to, the first that connects something to the port, or that
  // source if one is given.
  [[nodiscard]] std::optional<std::string> other_that_mentions(
      const std::string& port, const std::optional<std::string>& source = {}) const;

 private:
  std::uint64_t generation_ = 0;
  std::string name_, how_, by_;
  bool has_texts_ = false;
  bool is_older_ = false;
  rules::ModelTexts texts_;
  shm::Nanoseconds since_ = 0;
  std::map<std::string, shm::Nanoseconds> ports_since_;
  std::map<std::string, PastTimeout> timeouts_before_;
  nlohmann::json others_ = nlohmann::json::array();
};

// A path that the daemon has been given, which runs in `directory`: relative where it lies below
// the directory in which this program runs, else absolute.
std::string path_from_here(const std::string& path, const std::string& directory);

}  // namespace arbiter::cli
