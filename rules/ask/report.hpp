// Writes what was found: for people as compilers do, for programs as JSON.
#pragma once

#include <ostream>
#include <string>

#include "rules/text/diagnostic.hpp"

namespace arbiter::rules {

// file:line:column: error: message [code], with the line of the file and a caret below the place,
// a line for the witness where there is one, and a count of all at the end. Errors come first, then
// warnings; of the notes of each code the first ones only. Nothing if nothing was found.
void write_text(std::ostream& out, const Diagnostics& diagnostics);

// One array of {severity, code, file, line, column, message, help, witness, more_witnesses, port,
// ports, source, behaviour, statement, winners}, as docs/checking.md has it. What was found beyond
// the bound of a code is one object, "not-listed", with "code_omitted" and "count".
void write_json(std::ostream& out, const Diagnostics& diagnostics);
// "2 errors, 1 note"; "" if nothing was found.
std::string counts(const Diagnostics& diagnostics);

}  // namespace arbiter::rules
