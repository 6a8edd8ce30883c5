// Imports of texts, and what they decide.
#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gateway/core/incoming.hpp"
#include "gateway/mapping/read_mapping.hpp"
#include "importing/import.hpp"
#include "rules/explain/simulation.hpp"
#include "rules/model/load.hpp"
#include "rules/prove/compile.hpp"
#include "tests/gateway/foreign.hpp"

namespace arbiter::test {

enum class Program { kTwistMux, kCmdVelMux };

struct Imported {
  std::optional<importing::Plan> plan;  // a whole one
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
  if (result.diagnostics.has_errors()) result.plan.reset();
  return result;
}

// The model and the mapping of a plan, written, read as any other, and run by the code that decides
// on the robot: that of gateways says which port a message is for, and what a lock's message means.
class ImportedRobot {
 public:
  explicit ImportedRobot(const importing::Plan& plan)
      : mapping_(read(importing::write_mapping(plan, "model.xml"))),
        model_(compiled(importing::write_model(plan))),
        simulation_(model_) {}

  // Whether a message of a topic gets through.
  bool receives(const std::string& topic, shm::Nanoseconds now) {
    const gateway::Entry* const entry = entry_of(topic);
    // The mapping does not have it: nothing is published.
    return entry != nullptr && is_delivered(entry->port->name, now);
  }

  // A message of a lock.
  void receives_lock(const std::string& topic, bool pressed, shm::Nanoseconds now) {
    const gateway::Entry* const entry = entry_of(topic);
    if (entry == nullptr) return;
    const auto side = gateway::choose(*entry->choice, message_of(pressed));
    if (!side) {
      ADD_FAILURE() << topic << ": the gateway does not know what the message means";
      return;
    }
    const bool is_yes = *side == gateway::Side::kYes;
    const auto& chosen = is_yes ? entry->choice->yes : entry->choice->no;
    const auto& other = is_yes ? entry->choice->no : entry->choice->yes;
    if (chosen) happen(rules::TraceKind::kArrival, chosen->name, now);
    if (other) happen(rules::TraceKind::kDeactivation, other->name, now);
  }

 private:
  static constexpr std::size_t kEncapsulation = 4;  // bytes

  // A std_msgs/msg/Bool, as DDS has it.
  static gateway::BytesSample message_of(bool data) {
    return gateway::BytesSample(std::string("\0\1\0\0", kEncapsulation) + (data ? '\1' : '\0'),
                                kEncapsulation);
  }

  static gateway::Mapping read(const std::string& text) {
    rules::Diagnostics diagnostics;
    auto mapping = gateway::read_mapping(rules::TextFile("mapping.xml", text), diagnostics);
    for (const auto& item : diagnostics.items()) ADD_FAILURE() << item.message << "\n" << text;
    return mapping;
  }

  static rules::CompiledModel compiled(const std::string& text) {
    rules::Diagnostics diagnostics;
    const auto rules = rules::load(rules::ModelTexts{{{"model.xml", text}}, {}}, diagnostics);
    auto model = rules::compile(rules, diagnostics);
    for (const auto& item : diagnostics.items()) {
      EXPECT_EQ(item.severity, rules::Severity::kNote) << item.message << "\n" << text;
    }
    return model;
  }

  [[nodiscard]] const gateway::Entry* entry_of(const std::string& topic) const {
    for (const gateway::Entry& entry : mapping_.gateways.at(0).entries) {
      if (entry.is_in() && entry.dds->written == topic) return &entry;
    }
    return nullptr;
  }
  [[nodiscard]] const std::string& way_out() const {
    return mapping_.gateways.at(0).entries.back().port->name;
  }

  bool is_delivered(const std::string& port, shm::Nanoseconds now) {
    const rules::TraceEvent event{now, rules::TraceKind::kArrival, port};
    for (const auto& row : simulation_.step(event)) {
      if (row.port == way_out()) return row.outcome.delivered;
    }
    ADD_FAILURE() << port << " is not connected";
    return false;
  }

  void happen(rules::TraceKind kind, const std::string& source, shm::Nanoseconds now) {
    if (simulation_.knows(source)) simulation_.step({now, kind, source});
  }

  const gateway::Mapping mapping_;
  const rules::CompiledModel model_;
  rules::Simulation simulation_;
};

}  // namespace arbiter::test
