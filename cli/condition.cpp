#include "cli/condition.hpp"

#include <iostream>
#include <utility>

#include <CLI/CLI.hpp>

#include "rules/ask/report.hpp"
#include "rules/text/names.hpp"

namespace arbiter::cli {

rules::Statement read_condition(const char* option, const std::string& text) {
  const rules::TextFile file(option, text);
  rules::Diagnostics diagnostics;
  rules::Text condition(file, 0);
  condition.append(file.content(), 0);
  if (condition.is_blank()) throw CLI::ValidationError(option, "the condition is empty");
  if (rules::check_characters(file, diagnostics)) {
    if (auto parsed = rules::parse_statement(condition, diagnostics)) {
      return {rules::collapse_blanks(condition.bytes()), condition.where(), std::move(*parsed)};
    }
  }
  rules::write_text(std::cerr, diagnostics);
  throw CLI::ValidationError(option, "the condition cannot be read");
}

}  // namespace arbiter::cli
