// Statements: what must be true of a model in every state of its sources, in the language of
// conditions, which may also speak of who wins.
//
//   # Who has collided does not move.
//   /collision:o -> idle(/Arm/pos:i)
//   winner(/Arm/pos:i) = /Teleop/pos:o -> not winner(/Base/vel:i) = /Nav/vel:o
//
// One on each line; a line that begins with a blank goes on with the one above. '#' begins a
// comment, except in quotes. winner(PORT) = SOURCE, winner(PORT) = any(GLOB), of whose sources one
// wins, winner(PORT) = winner(PORT), the same or nobody at either, winner(PORT) = none and
// idle(PORT), which means the same, are operands like a source's name; so are those with "!=".
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "rules/model/condition_parser.hpp"
#include "rules/text/diagnostic.hpp"
#include "rules/text/text_file.hpp"

namespace arbiter::rules {

inline constexpr std::size_t kMaxStatements = 10'000;

struct Statement {
  std::string text;  // on one line, without comments
  Location where;
  ParsedStatement parsed;
};

// Reports all that is malformed, and a file without any; the others are returned. `malformed`, if
// given, is how many are not.
std::vector<Statement> read_statements(const TextFile& file, Diagnostics& diagnostics,
                                       std::size_t* malformed = nullptr);

}  // namespace arbiter::rules
