// Imports of texts, and what they decide.
#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "importing/import.hpp"
#include "rules/explain/simulation.hpp"
#include "rules/model/load.hpp"
#include "rules/prove/compile.hpp"

namespace arbiter::test {

enum class Program { kTwistMux, kCmdVelMux };

struct Imported {
  std::optional<importing::Plan> plan;
  rules::Diagnostics diagnostics;

  // "2:14 error same-topic", each.
  [[nodiscard]] std::vector<std::string> findings() const {
    static constexpr const char* kSeverities[] = {"error", "warning", "note"};
    std::vector<std::string> result;
    for (const rules::Diagnostic& item : diagnostics.items()) {
      result.push_back(std::to_string(item.where.line) + ":" + std::to_string(item.where.column) +
                       " " + kSeverities[static_cast<int>(item.severity)] + " " + item.code);
    }
    return result;
  }
  [[nodiscard]] std::string message(std::string_view code) const {
    for (const rules::Diagnostic& item : diagnostics.items()) {
      if (item.code == code) return item.message;
    }
    return "";
  }
  // Of a command, in their order: its topic.
  [[nodiscard]] std::vector<std::string> topics() const {
    std::vector<std::string> result;
    for (const auto& command : plan->commands) result.push_back(command.topic);
    return result;
  }
};

// The files are called a.yaml, b.yaml, …
inline Imported import_texts(Program program, const std::vector<std::string>& texts,
                             const importing::ImportOptions& options = {}) {
  std::vector<importing::InputFile> files;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    files.push_back({std::string(1, static_cast<char>('a' + i)) + ".yaml", texts[i]});
  }
  Imported result;
  result.plan = program == Program::kTwistMux
                    ? importing::import_twist_mux(files, options, result.diagnostics)
                    : importing::import_cmd_vel_mux(files, options, result.diagnostics);
  return result;
}

// The model of a plan, written, read as any other, and run by the code that decides on the robot.
class ImportedRobot {
 public:
  explicit ImportedRobot(const importing::Plan& plan)
      : plan_(plan), model_(compiled(importing::write_model(plan))), simulation_(model_) {}

  // Whether a message of a topic gets through.
  bool receives(const std::string& topic, shm::Nanoseconds now) {
    for (const importing::Command& command : plan_.commands) {
      if (command.topic == topic) return is_delivered(command.port, now);
    }
    return false;  // the mapping does not have it: nothing is published
  }

  // A sample of a lock, as a gateway publishes it.
  void receives_lock(const std::string& topic, bool pressed, shm::Nanoseconds now) {
    for (const importing::Lock& lock : plan_.locks) {
      if (lock.topic != topic) continue;
      happen(rules::TraceKind::kArrival, pressed ? lock.pressed : lock.released, now);
      happen(rules::TraceKind::kDeactivation, pressed ? lock.released : lock.pressed, now);
    }
  }

 private:
  static rules::CompiledModel compiled(const std::string& text) {
    rules::Diagnostics diagnostics;
    const auto rules = rules::load(rules::ModelTexts{{{"model.xml", text}}, {}}, diagnostics);
    auto model = rules::compile(rules, diagnostics);
    for (const auto& item : diagnostics.items()) {
      EXPECT_EQ(item.severity, rules::Severity::kNote) << item.message << "\n" << text;
    }
    return model;
  }

  bool is_delivered(const std::string& port, shm::Nanoseconds now) {
    const rules::TraceEvent event{now, rules::TraceKind::kArrival, port};
    for (const auto& row : simulation_.step(event)) {
      if (row.port == plan_.output_port) return row.outcome.delivered;
    }
    ADD_FAILURE() << port << " is not connected";
    return false;
  }

  void happen(rules::TraceKind kind, const std::string& source, shm::Nanoseconds now) {
    if (simulation_.knows(source)) simulation_.step({now, kind, source});
  }

  const importing::Plan& plan_;
  const rules::CompiledModel model_;
  rules::Simulation simulation_;
};

}  // namespace arbiter::test
