// What loading the model in force has said of names that nobody has: who asks why a port does as it
// does may be looking for a misspelt name.
#pragma once

#include <ostream>
#include <vector>

#include <nlohmann/json.hpp>

#include "rules/text/diagnostic.hpp"

namespace arbiter::cli {

// Those of `found`: never-published, never-read, pattern-as-name, similar-name, wrong-end and
// matches-nothing.
std::vector<rules::Diagnostic> name_warnings(const rules::Diagnostics& found);

// A line each, of the first few; nothing if there is none.
void write_text(std::ostream& out, const std::vector<rules::Diagnostic>& warnings);
// [{"code", "file", "line", "column", "message"}]
nlohmann::json to_json(const std::vector<rules::Diagnostic>& warnings);

}  // namespace arbiter::cli
