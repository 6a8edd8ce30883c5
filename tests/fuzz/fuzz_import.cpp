// A multiplexer's parameters: read as each program's, and what is written is a model and a mapping.
#include "importing/import.hpp"
#include "rules/model/load.hpp"
#include "rules/prove/compile.hpp"
#include "rules/text/xml.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace arbiter::fuzz {
namespace {

constexpr std::size_t kMaxCompiled = 60;  // of more, compiling takes longer than an input should

void check_plan(const importing::Plan& plan) {
  rules::Diagnostics diagnostics;
  const rules::TextFile mapping("mapping", importing::write_mapping(plan, "model"));
  require(rules::parse_xml(mapping, diagnostics).has_value() && !diagnostics.has_errors(),
          "the mapping is XML");
  const std::string model = importing::write_model(plan);
  const auto rules = rules::load(rules::ModelTexts{{{"model", model}}, {}}, diagnostics);
  require(!diagnostics.has_errors(), "the model can be read");
  require(rules.ports.size() == 1 && rules.ports.front().rules.size() == plan.commands.size(),
          "each command has a rule");
  if (plan.commands.size() > kMaxCompiled) return;
  rules::compile(rules, diagnostics);
  require(diagnostics.count(rules::Severity::kError) == 0, "the model can be run");
  require(diagnostics.count(rules::Severity::kWarning) == 0, "and has nothing to warn of");
}

void check(const std::string& text) {
  const std::vector<importing::InputFile> files{{"input", text}};
  for (const auto import : {importing::import_twist_mux, importing::import_cmd_vel_mux}) {
    rules::Diagnostics diagnostics;
    const auto plan = import(files, {}, diagnostics);
    check_findings(diagnostics);
    require(plan.has_value() || diagnostics.has_errors(), "an error is why there is nothing");
    if (!diagnostics.has_errors()) check_plan(*plan);
  }
}

}  // namespace
}  // namespace arbiter::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  arbiter::fuzz::check(arbiter::fuzz::text_of(data, size));
  return 0;
}
