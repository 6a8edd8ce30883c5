// Names: how they are normalised, what they may consist of, how they appear in messages.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace arbiter::rules {

std::string_view trim(std::string_view text);
// Of ASCII, whatever the locale.
std::string lower_case(std::string_view text);

// Trimmed, and each run of white space inside made one blank.
std::string collapse_blanks(std::string_view text);

// In double quotes, with single ones for those within it, so that what reads a message sees where
// the name ends. quote() cuts what is too long for a message.
std::string quote(std::string_view name);
std::string quote_whole(std::string_view name);

// Names that a sentence spells out; of more it says how many.
inline constexpr std::size_t kMaxNamesInWords = 6;

// "/a, /b and /c".
std::string enumerate(const std::vector<std::string>& names);

// "/a, /b, /c".
std::string comma_list(const std::vector<std::string>& names);

// "1 port", "2 ports".
std::string counted(std::uint64_t count, std::string_view thing);

// What is wrong with a name, and at which byte of it.
struct NameProblem {
  std::string code;
  std::string message;
  std::size_t at = 0;
};

// A port's name begins with '/' and takes any printable UTF-8 except white space and the double
// quote, which could not be written in a condition. The name is taken to be trimmed.
std::optional<NameProblem> find_problem_in_port(std::string_view name);

// A port in an application file, which may be none of ours: "topic://map" is fine there.
std::optional<NameProblem> find_problem_in_foreign_port(std::string_view name);

// The name of a host, as links take it.
std::optional<std::string> find_problem_in_host(std::string_view name);

// The name of a behaviour or meta-behaviour. A comma would take it apart in an <inhibition>.
std::optional<NameProblem> find_problem_in_behaviour(std::string_view name);

// The candidate that a misspelt name was probably meant to be, at most two edits away.
std::optional<std::string> find_similar(std::string_view name,
                                        const std::vector<std::string_view>& candidates);

// Finding a similar name means to compare with all. Whoever has reported that many problems already
// does without, or a large file full of mistakes would take for ever.
inline constexpr std::size_t kMaxSuggestions = 100;

// What to do about a misspelt name, to be put behind a message: "; did you mean "X"?", or if no
// candidate is similar, "; " and the other advice.
std::string advise(std::string_view name, const std::vector<std::string_view>& candidates,
                   std::string_view otherwise);

}  // namespace arbiter::rules
