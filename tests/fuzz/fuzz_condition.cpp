// A condition: parsed, its quantifiers expanded, written again, parsed again: it means the same.
#include <random>

#include "rules/model/condition_parser.hpp"
#include "rules/model/print_rules.hpp"
#include "rules/model/quantifiers.hpp"
#include "rules/text/text.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/support/meaning.hpp"

namespace arbiter::fuzz {
namespace {

using test::Active;
using test::holds;

constexpr std::size_t kMaxCompared = 20'000;  // bytes
constexpr int kActivations = 16;

std::optional<rules::ExpressionPtr> parse(const rules::TextFile& file,
                                          rules::Diagnostics& diagnostics) {
  rules::Text text(file, 0);
  text.append(file.content(), 0);
  return rules::parse_condition(text, diagnostics);
}

void collect(const rules::Expression& expression, Active& names) {
  if (expression.op == rules::Operator::kSource) names.insert(expression.name);
  for (const auto& operand : expression.operands) collect(*operand, names);
}

int depth_of(const rules::Expression& expression) {
  int depth = 0;
  for (const auto& operand : expression.operands) depth = std::max(depth, depth_of(*operand));
  return depth + 1;
}

void check_condition(const std::string& written) {
  const rules::TextFile file("condition", written);
  rules::Diagnostics diagnostics;
  if (!rules::check_characters(file, diagnostics)) return check_findings(diagnostics);
  const auto parsed = parse(file, diagnostics);
  check_findings(diagnostics);
  require(parsed.has_value() != diagnostics.has_errors(), "either a result or an error");
  if (!parsed) return;
  require(depth_of(**parsed) <= rules::kMaxConditionDepth, "the depth is bounded");
  rules::Model model;
  model.selects.push_back({"/own", "/port", *parsed, {}, 0});
  const auto sources = rules::collect_sources(model);
  const auto expanded = rules::QuantifierExpansion(sources).expand(*parsed);
  const std::string printed = rules::to_string(*expanded);
  if (printed.size() > kMaxCompared) return;
  const rules::TextFile again("again", printed);
  const auto reparsed = parse(again, diagnostics);
  if (!reparsed) {  // a quantifier written out is deeper than it was
    require(diagnostics.items().front().code == "limit-exceeded", "what is printed can be read");
    return;
  }
  Active names;
  collect(**parsed, names);
  std::mt19937_64 random(written.size());
  for (int i = 0; i < kActivations; ++i) {
    Active active;
    for (const auto& name : names) {
      if (random() % 2 == 0) active.insert(name);
    }
    require(holds(*expanded, active) == holds(**reparsed, active), "it means the same");
  }
}

}  // namespace
}  // namespace arbiter::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  arbiter::fuzz::check_condition(arbiter::fuzz::text_of(data, size));
  return 0;
}
