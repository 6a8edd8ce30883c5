#include "cli/port_patterns.hpp"

#include <algorithm>
#include <iostream>

#include "command_line/shell_word.hpp"
#include "rules/model/quantifiers.hpp"
#include "rules/text/names.hpp"
#include "shm/utf8.hpp"

namespace arbiter::cli {
namespace {

template <class Ports>
std::vector<std::string_view> names_of(const Ports& ports) {
  std::vector<std::string_view> names;
  names.reserve(ports.size());
  for (const auto& port : ports) names.push_back(port.name);
  return names;
}

// The first of them; null: there is none.
const std::string_view* match_among(const std::vector<std::string_view>& names,
                                    const std::string& pattern) {
  const auto found = std::find_if(names.begin(), names.end(), [&](std::string_view each) {
    return rules::matches(pattern, each);
  });
  return found == names.end() ? nullptr : &*found;
}

constexpr const char* kIsOutput = "output port: name an input port that it is connected to";

}  // namespace

void warn_without_match(const std::string& option, const std::string& pattern,
                        const PatternNames& known) {
  if (match_among(known.names, pattern) != nullptr) return;
  std::string text = option + ' ' + shm::printable(command_line::shell_word(pattern)) +
                     " matches no " + known.what;
  if (const std::string_view* const other = match_among(known.others, pattern)) {
    text += "; " + shm::printable(std::string(*other)) + " is an " + known.other_what;
  } else if (const std::string similar = rules::similar_pattern(pattern, known.names);
             !similar.empty()) {
    text += "; did you mean " + rules::quote(shm::printable(similar)) + '?';
  }
  std::cerr << "arbiter: warning: " + text + '\n';
}

void PatternCheck::inputs(const std::vector<std::string>& patterns) const {
  const PatternNames known{names_of(status_.inputs), names_of(status_.sources),
                           "input port that is open or in the model in force", kIsOutput};
  for (const std::string& pattern : patterns) warn_without_match(option_, pattern, known);
}

void PatternCheck::arbitrated_inputs(const std::vector<std::string>& patterns) const {
  PatternNames known{
      {}, names_of(status_.sources), "input port that the model in force arbitrates", kIsOutput};
  for (const wire::InputStatus& input : status_.inputs) {
    if (input.arbitrated) known.names.push_back(input.name);
  }
  for (const std::string& pattern : patterns) warn_without_match(option_, pattern, known);
}

void PatternCheck::outputs(const std::vector<std::string>& patterns) const {
  const PatternNames known{names_of(status_.sources), names_of(status_.inputs),
                           "output port that is open or in the model in force",
                           "input port: name an output port that is connected to it"};
  for (const std::string& pattern : patterns) warn_without_match(option_, pattern, known);
}

}  // namespace arbiter::cli
