#include "cli/recording_compile.hpp"

#include <iostream>
#include <stdexcept>
#include <utility>

#include "rules/ask/report.hpp"

namespace arbiter::cli {

Model compile_recorded(const rules::ModelTexts& texts, double effort, rules::Keep keep) {
  rules::Diagnostics diagnostics;
  rules::RuleSet rules = rules::load(texts, diagnostics, keep);
  rules::CompiledModel compiled = compile_model(rules, diagnostics, effort);
  if (!diagnostics.has_errors()) return {std::move(rules), std::move(compiled)};
  rules::write_text(std::cerr, diagnostics);
  throw std::runtime_error("a model of the recording cannot be loaded");
}

evidence::Compile recording_compiler(double effort) {
  return [effort](const rules::ModelTexts& texts) {
    return compile_recorded(texts, effort, rules::Keep::kRules).compiled;
  };
}

}  // namespace arbiter::cli
