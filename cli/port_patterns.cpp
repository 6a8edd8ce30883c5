#include "cli/port_patterns.hpp"

#include <algorithm>
#include <iostream>
#include <set>

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

// As much of a name as there is of the pattern in front of its first '*': to the same '/', or
// within a part as many bytes.
std::string_view same_beginning(std::string_view name, std::string_view before_star) {
  if (!before_star.ends_with('/')) return name.substr(0, before_star.size());
  std::size_t at = 0;
  for (auto left = std::count(before_star.begin(), before_star.end(), '/'); left > 0; --left) {
    at = name.find('/', at);
    if (at == std::string_view::npos) return {};
    ++at;
  }
  return name.substr(0, at);
}

// As many parts of a name as the pattern begins, to the end of the last of them.
std::string_view same_parts(std::string_view name, std::string_view before_star) {
  if (before_star.ends_with('/')) return {};
  const auto parts = std::count(before_star.begin(), before_star.end(), '/');
  std::size_t at = 0;
  for (auto left = parts; left > 0 && at != std::string_view::npos; --left) {
    at = name.find('/', at);
    if (at != std::string_view::npos) ++at;
  }
  if (at == std::string_view::npos) return {};
  return name.substr(0, name.find_first_of("/:", at));
}

constexpr const char* kIsOutput = "output port: name an input port that it is connected to";

}  // namespace

std::string similar_pattern(const std::string& pattern,
                            const std::vector<std::string_view>& names) {
  const std::size_t star = pattern.find('*');
  if (star == std::string::npos) return rules::find_similar(pattern, names).value_or("");
  std::string before = pattern.substr(0, star);
  if (!before.empty() && before.front() != '/') before.insert(0, 1, '/');
  std::set<std::string> candidates;
  for (const std::string_view name : names) {
    for (const std::string_view beginning :
         {same_beginning(name, before), same_parts(name, before)}) {
      if (beginning.empty()) continue;
      std::string candidate = std::string(beginning) + pattern.substr(star);
      if (rules::matches(candidate, name)) candidates.insert(std::move(candidate));
    }
  }
  return rules::find_similar(pattern, {candidates.begin(), candidates.end()}).value_or("");
}

void warn_without_match(const std::string& option, const std::string& pattern,
                        const PatternNames& known) {
  if (match_among(known.names, pattern) != nullptr) return;
  std::string text = option + ' ' + shm::printable(command_line::shell_word(pattern)) +
                     " matches no " + known.what;
  if (const std::string_view* const other = match_among(known.others, pattern)) {
    text += "; " + shm::printable(std::string(*other)) + " is an " + known.other_what;
  } else if (const std::string similar = similar_pattern(pattern, known.names); !similar.empty()) {
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
