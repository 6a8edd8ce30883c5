// Models given as text, read through load() as everybody else reads them.
#pragma once

#include <ctime>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "rules/model/load.hpp"
#include "rules/model/rule_set.hpp"
#include "rules/text/diagnostic.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::rules {

using Folder = test::TemporaryDirectory;

// Seconds of processor time since it was made: other programs on the machine do not count.
class Stopwatch {
 public:
  [[nodiscard]] double seconds() const {
    return static_cast<double>(std::clock() - start_) / CLOCKS_PER_SEC;
  }

 private:
  std::clock_t start_ = std::clock();
};

struct Loaded {
  RuleSet rules;
  std::vector<Diagnostic> items;
  bool has_errors = false;

  // "2:14 error unknown-name", each; where there are several files, behind "b.xml:".
  [[nodiscard]] std::vector<std::string> findings(bool with_files = false) const {
    static constexpr const char* kSeverities[] = {"error", "warning", "note"};
    std::vector<std::string> result;
    for (const Diagnostic& item : items) {
      const std::string file = std::filesystem::path(item.where.file).filename().string();
      result.push_back((with_files ? file + ":" : "") + std::to_string(item.where.line) + ":" +
                       std::to_string(item.where.column) + " " +
                       kSeverities[static_cast<int>(item.severity)] + " " + item.code);
    }
    return result;
  }
  [[nodiscard]] std::string message(std::size_t i = 0) const {
    return i < items.size() ? items[i].message : "";
  }
  [[nodiscard]] const PortRules* port(std::string_view name) const {
    for (const PortRules& port : rules.ports) {
      if (port.port == name) return &port;
    }
    return nullptr;
  }
};

inline Loaded load_files(const ModelFiles& files) {
  Loaded loaded;
  Diagnostics diagnostics;
  loaded.rules = load(files, diagnostics, Keep::kProvenance);
  loaded.items = diagnostics.items();
  loaded.has_errors = diagnostics.has_errors();
  return loaded;
}

// The models are named a.xml, b.xml, …
inline Loaded load_texts(const std::vector<std::string>& models) {
  const Folder folder;
  ModelFiles files;
  for (std::size_t i = 0; i < models.size(); ++i) {
    files.models.push_back(
        folder.write(std::string(1, static_cast<char>('a' + i)) + ".xml", models[i]));
  }
  return load_files(files);
}

inline Loaded load_text(const std::string& model) { return load_texts({model}); }

inline Loaded load_with_application(const std::string& model, const std::string& application) {
  const Folder folder;
  return load_files({{folder.write("a.xml", model)}, folder.write("app.xml", application)});
}

// Fully parenthesised, so that a test sees the structure: (/a and not(/b)).
inline std::string show(const ExpressionPtr& expression) {
  static constexpr const char* kNames[] = {"false", "true",    "",    "not", "and", "or",
                                           "xor",   "implies", "iff", "any", "all", "none"};
  const std::string name = kNames[static_cast<int>(expression->op)];
  switch (expression->op) {
    case Operator::kFalse:
    case Operator::kTrue:
      return name;
    case Operator::kSource:
      return expression->name;
    case Operator::kNot:
      return "not(" + show(expression->operands.at(0)) + ")";
    case Operator::kAny:
    case Operator::kAll:
    case Operator::kNone:
      return name + "(" + expression->name + ")";
    default:
      break;
  }
  std::string result = "(";
  for (std::size_t i = 0; i < expression->operands.size(); ++i) {
    if (i > 0) result += " " + name + " ";
    result += show(expression->operands[i]);
  }
  return result + ")";
}

// "/s: condition" of each rule at a port, in order.
inline std::vector<std::string> show_rules(const Loaded& loaded, std::string_view port) {
  std::vector<std::string> result;
  const PortRules* found = loaded.port(port);
  if (found == nullptr) return result;
  for (const ConnectionRule& rule : found->rules) {
    result.push_back(rule.source + ": " + show(rule.condition));
  }
  return result;
}

// The paper's Listing 1, as it stands there.
inline constexpr std::string_view kListing1 = R"(<define name="gaze"> /Gaze/pos:i </define>

<meta_behavior name="Be Curious">
   <behavior>Look Around</behavior>
   <behavior>Follow Face</behavior>
   <condition></condition>
   <inhibition></inhibition>
</meta_behavior>

<behavior name="Look Around">
   <config at="${gaze}">/RandomLook/pos:o</config>
   <condition></condition>
   <inhibition></inhibition>
</behavior>

<behavior name="Follow Face">
   <config at="${gaze}">/Face/pos:o</config>
   <condition></condition>
   <inhibition>Look Around</inhibition>
</behavior>
)";

}  // namespace arbiter::rules
