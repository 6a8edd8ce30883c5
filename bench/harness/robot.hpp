// An arbiterd of the benchmark's own, with a model, for the workers to be components of.
#pragma once

#include <string>

#include <arbiter/arbiter.hpp>

#include "bench/harness/program.hpp"

namespace arbiter::bench {

class Robot {
 public:
  static constexpr const char* kInstance = "bench";

  // Starts arbiterd; `model` is the text of a model file.
  explicit Robot(const std::string& model);

  // In a worker: a node of this robot. Waits until the daemon answers.
  [[nodiscard]] Node node(const std::string& name) const;
  // Puts another model in force; returns at once.
  void load(const std::string& model) const;
  // Where its socket is, for a program that is no worker: $XDG_RUNTIME_DIR.
  [[nodiscard]] const std::string& runtime_directory() const { return directory_.path(); }
  [[nodiscard]] pid_t daemon() const { return daemon_.pid(); }
  // What arbiterd has said, for an error message.
  [[nodiscard]] std::string log() const;

 private:
  [[nodiscard]] std::string file(const char* name) const { return directory_.path() + "/" + name; }
  void write_model(const std::string& model) const;

  ScratchDirectory directory_;
  Program daemon_;
};

// Models, by what a connection's rule reads.

// The connection from `source` to `port`, wherever none of `sensed` others is active; the rule is a
// conjunction of so many activities. With 0, it always holds.
std::string behaviour(const std::string& source, const std::string& port, int sensed);
// Around behaviours: a whole model.
std::string model(const std::string& behaviours, const std::string& timeout = "500ms");

}  // namespace arbiter::bench
