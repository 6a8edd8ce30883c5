#include "cli/recording_compile.hpp"

#include <iostream>
#include <stdexcept>

#include "cli/model_files.hpp"
#include "rules/ask/report.hpp"

namespace arbiter::cli {

evidence::Compile recording_compiler(double effort) {
  return [effort](const rules::ModelTexts& texts) {
    rules::Diagnostics diagnostics;
    const rules::RuleSet rules = rules::load(texts, diagnostics);
    rules::CompiledModel compiled = compile_model(rules, diagnostics, effort);
    if (!diagnostics.has_errors()) return compiled;
    rules::write_text(std::cerr, diagnostics);
    throw std::runtime_error("a model of the recording cannot be loaded");
  };
}

}  // namespace arbiter::cli
