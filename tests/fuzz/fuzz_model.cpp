// A model file, all the way: read, checked, extracted, compiled and proved, flattened, decided
// with.
#include <random>
#include <stdexcept>

#include "rules/model/application_writer.hpp"
#include "rules/model/load.hpp"
#include "rules/model/print_rules.hpp"
#include "rules/prove/compile.hpp"
#include "rules/prove/flatten.hpp"
#include "rules/text/xml.hpp"
#include "tests/fuzz/file_in_memory.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/support/live_table.hpp"
#include "tests/support/meaning.hpp"

namespace arbiter::fuzz {
namespace {

using test::Active;
using test::holds;

// Larger ones are read, but neither compiled nor compared: that would be a test of patience.
constexpr std::size_t kMaxSources = 40, kMaxRules = 60, kMaxExpressions = 2'000;
constexpr int kActivations = 24;

std::size_t count_expressions(const rules::Expression& expression) {
  std::size_t count = 1;
  for (const auto& operand : expression.operands) {
    count += count_expressions(*operand);
    if (count > kMaxExpressions) break;
  }
  return count;
}

bool is_small(const rules::RuleSet& rules) {
  std::size_t count = 0, expressions = 0;
  for (const auto& port : rules.ports) {
    count += port.rules.size();
    if (count > kMaxRules) return false;
    for (const auto& rule : port.rules) {
      expressions += count_expressions(*rule.condition);
      if (expressions > kMaxExpressions) return false;
    }
  }
  return rules.sources.size() <= kMaxSources;
}

bool selects(const rules::ConnectionRule& rule, const Active& active) {
  return active.contains(rule.source) && holds(*rule.condition, active);
}

// The table decides as the rules say, and at most one connection of a port wins.
void compare(const rules::RuleSet& rules, test::LiveTable& table, const Active& active) {
  table.activate_only(active);
  for (const auto& port : rules.ports) {
    std::vector<std::string> expected;
    for (const auto& rule : port.rules) {
      if (selects(rule, active)) expected.push_back(rule.source);
    }
    if (port.first_wins && !expected.empty()) expected.resize(1);
    require(expected.size() <= 1, "at most one connection of a port can win");
    require(table.winners(port.port) == expected, "the table decides as the rules say");
  }
}

void compile_and_compare(const rules::RuleSet& rules, std::size_t seed) {
  rules::Diagnostics diagnostics;
  const rules::CompiledModel model = rules::compile(rules, diagnostics);
  check_findings(diagnostics);
  if (diagnostics.has_errors()) return;
  const auto any_id = [](const std::string&) { return 0u; };
  require(rules::flatten(model, {any_id, any_id}).size() <= rules::largest_table(model),
          "a table is within its estimate");
  test::LiveTable table(model);
  std::mt19937_64 random(seed);
  compare(rules, table, {});
  compare(rules, table, {rules.sources.begin(), rules.sources.end()});
  for (int i = 0; i < kActivations; ++i) {
    Active active;
    for (const auto& source : rules.sources) {
      if (random() % 2 == 0) active.insert(source);
    }
    compare(rules, table, active);
  }
}

// The rules, merged into an application, read back as the same: but for limits, which what is
// written out may exceed.
void merge_and_compare(const rules::RuleSet& rules, std::string_view text) {
  const bool is_application = rules::root_name(text) == "application";
  const std::string merged =
      is_application ? rules::merge_rules(rules, text) : rules::write_application(rules, "fuzz");
  const FileInMemory file(merged);
  rules::Diagnostics diagnostics;
  const rules::RuleSet again = rules::load({{file.path()}, {}}, diagnostics);
  for (const auto& item : diagnostics.items()) {
    if (item.severity != rules::Severity::kError) continue;
    require(item.code == "limit-exceeded", "what is merged can be read");
  }
  require(diagnostics.has_errors() || rules::same_rules(again, rules), "and means the same");
}

void check_model(std::string_view text) {
  const FileInMemory file(text);
  rules::Diagnostics diagnostics;
  const rules::RuleSet rules = rules::load({{file.path()}, {}}, diagnostics);
  check_findings(diagnostics);
  if (diagnostics.has_errors()) return;
  std::ostringstream printed;
  rules::write_rules_json(printed, rules);
  if (is_small(rules)) {
    rules::write_rules(printed, rules);
    merge_and_compare(rules, text);
    compile_and_compare(rules, text.size());
  }
}

}  // namespace
}  // namespace arbiter::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  arbiter::fuzz::check_model(arbiter::fuzz::text_of(data, size));
  return 0;
}
