// Conditions: first-order logic over the finite set of sources (paper, section IV.A).
//
//   loosest   iff       <->  ↔      left-associative
//             implies   ->   →      right-associative
//             or        | || ∨
//             xor                   left-associative
//             and       & && ∧
//   tightest  not       !  ~ ¬
//
// Operands: a port's name, true, false, ( … ), any(GLOB), all(GLOB), none(GLOB). A bare name begins
// with '/' and takes letters, digits and _ . : / -, except that "->" is always the operator; other
// names stand in double quotes. A name says that this source is active.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "rules/model/expression.hpp"
#include "rules/model/model.hpp"
#include "rules/text/diagnostic.hpp"
#include "rules/text/text.hpp"

namespace arbiter::rules {

// Of parentheses, and of operators inside each other; whoever walks an expression may recurse.
inline constexpr int kMaxConditionDepth = 500;

// The text must not be blank: what an absent condition means is the caller's to know. Empty where
// it is malformed, which was then reported.
// `sources` and `globs`, if given, get each mention of a source, and each pattern of a quantifier.
std::optional<ExpressionPtr> parse_condition(const Text& text, Diagnostics& diagnostics,
                                             std::vector<Mention>* sources = nullptr,
                                             std::vector<Mention>* globs = nullptr);

// What a statement says of the winner at a port, with "winner(/p) = /s", "winner(/p) = any(/s/*)",
// "winner(/p) = winner(/q)", "winner(/p) = none", each with "!=" as well, or "idle(/p)". Each is an
// operand.
struct WinnerTerm {
  Mention port;
  // One of them; with neither of them, nobody wins.
  std::optional<Mention> source{};
  std::optional<Mention> pattern{};     // of the sources of which one wins
  std::optional<Mention> other_port{};  // the same source wins there, or nobody at either
};

struct ParsedStatement {
  ExpressionPtr expression;       // has the term i as a source named term_name(i)
  std::vector<WinnerTerm> terms;  // in order
  std::vector<Mention> sources;   // each mention of one outside of the terms
  std::vector<Mention> globs;     // each pattern of a quantifier
};

// No source is called so.
inline std::string term_name(std::size_t term) { return "=" + std::to_string(term); }

// Conditions that may speak of winners.
std::optional<ParsedStatement> parse_statement(const Text& text, Diagnostics& diagnostics);

}  // namespace arbiter::rules
