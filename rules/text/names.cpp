#include "rules/text/names.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <tuple>

#include "shm/limits.hpp"
#include "shm/utf8.hpp"

namespace arbiter::rules {
namespace {

constexpr std::size_t kMaxEdits = 2;
constexpr std::size_t kMaxComparedLength = 64;

std::optional<NameProblem> find_length_problem(std::string_view name) {
  if (name.size() <= shm::kMaxNameLength) return {};
  return NameProblem{"name-too-long",
                     "the name " + quote(name) + " has " + std::to_string(name.size()) +
                         " bytes, more than the limit of " + std::to_string(shm::kMaxNameLength) +
                         "; shorten it",
                     0};
}

// How many single characters must be put in, taken out or replaced; two neighbours in the wrong
// order are one slip.
std::size_t count_edits(std::string_view a, std::string_view b) {
  std::array<std::array<std::size_t, kMaxComparedLength + 1>, 3> rows;  // by lengths of a, modulo 3
  std::iota(rows[0].begin(), rows[0].end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    const auto& shorter_by_two = rows[(i + 2) % 3];
    const auto& shorter = rows[i % 3];
    auto& row = rows[(i + 1) % 3];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = shorter[j] + (a[i] == b[j] ? 0 : 1);
      row[j + 1] = std::min({replaced, row[j] + 1, shorter[j + 1] + 1});
      if (i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j]) {
        row[j + 1] = std::min(row[j + 1], shorter_by_two[j - 1] + 1);
      }
    }
  }
  return rows[a.size() % 3][b.size()];
}

constexpr std::size_t distance(std::size_t a, std::size_t b) { return a < b ? b - a : a - b; }

constexpr std::size_t kMostAside = 3;  // "/" and ":o"

// A name as it is compared: of a port's, what most others have as well stands aside.
struct Compared {
  std::string own;             // in small letters
  std::string_view direction;  // "o" of "/Face/pos:o"
};

Compared compared(std::string_view name) {
  Compared result;
  if (name.starts_with('/')) name.remove_prefix(1);
  if (name.size() > 2 && name[name.size() - 2] == ':') {
    result.direction = name.substr(name.size() - 1);
    name.remove_suffix(2);
  }
  for (const char each : name) result.own += each >= 'A' && each <= 'Z' ? char(each + 32) : each;
  return result;
}

}  // namespace

std::string_view trim(std::string_view text) {
  while (!text.empty() && shm::is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && shm::is_blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string lower_case(std::string_view text) {
  std::string result(text);
  for (char& each : result) each = each >= 'A' && each <= 'Z' ? static_cast<char>(each + 32) : each;
  return result;
}

std::string collapse_blanks(std::string_view text) {
  std::string result;
  bool gap = false;
  for (const char byte : trim(text)) {
    if (shm::is_blank(byte)) {
      gap = true;
      continue;
    }
    if (gap) result += ' ';
    gap = false;
    result += byte;
  }
  return result;
}

std::string quote(std::string_view name) {
  constexpr std::size_t kMaxQuoted = 80;
  if (name.size() <= kMaxQuoted) return quote_whole(name);
  return quote_whole(std::string(shm::beginning_of(name, kMaxQuoted)) + "…");
}

std::string quote_whole(std::string_view name) {
  std::string quoted = '"' + std::string(name) + '"';
  std::replace(quoted.begin() + 1, quoted.end() - 1, '"', '\'');
  return quoted;
}

std::string enumerate(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i == kMaxNamesInWords) return text + " and " + std::to_string(names.size() - i) + " more";
    if (i > 0) text += i + 1 == names.size() ? " and " : ", ";
    text += names[i];
  }
  return text;
}

std::string comma_list(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::string counted(std::uint64_t count, std::string_view thing) {
  return std::to_string(count) + ' ' + std::string(thing) + (count == 1 ? "" : "s");
}

std::optional<NameProblem> find_problem_in_port(std::string_view name) {
  if (auto problem = find_length_problem(name)) return problem;
  if (name.size() > 2 && name.starts_with("\"/") && name.ends_with('"')) {
    const std::string_view within = name.substr(1, name.size() - 2);
    if (auto problem = find_problem_in_port(within)) {
      ++problem->at;
      return problem;
    }
    return NameProblem{"invalid-port-name",
                       "only in a condition does a port's name have quotes; write " +
                           std::string(within) + " without them",
                       0};
  }
  if (name.starts_with('$')) {
    return NameProblem{
        "invalid-port-name",
        "a port's name begins with '/', and a define is used as ${name}; correct " + quote(name),
        0};
  }
  if (!name.starts_with('/')) {
    return NameProblem{"invalid-port-name",
                       "a port's name begins with '/'; write " + quote("/" + std::string(name)) +
                           " for " + quote(name),
                       0};
  }
  if (const auto fault = shm::find_fault_in_name(name)) {
    const bool is_list =
        shm::is_blank(name[fault->at]) && trim(name.substr(fault->at)).starts_with('/');
    if (is_list) {
      return NameProblem{"invalid-port-name",
                         quote(name) + " are several names; write an element for each of them",
                         fault->at};
    }
    return NameProblem{
        "invalid-port-name",
        "the port's name " + quote(name) + " has " + fault->what + " in it; remove it", fault->at};
  }
  return {};
}

std::optional<NameProblem> find_problem_in_foreign_port(std::string_view name) {
  if (auto problem = find_length_problem(name)) return problem;
  const auto is_control_byte = [](char byte) {
    return shm::is_control(static_cast<unsigned char>(byte)) &&
           static_cast<unsigned char>(byte) < 0x80;
  };
  const auto* found = std::find_if(name.begin(), name.end(), is_control_byte);
  if (found == name.end()) return {};
  return NameProblem{"invalid-port-name",
                     "a port's name has no line ends or other control characters in it; "
                     "remove them",
                     static_cast<std::size_t>(found - name.begin())};
}

std::optional<std::string> find_problem_in_host(std::string_view name) {
  if (shm::is_host_name(name)) return {};
  return quote(name) + " is no name of a host, and no link takes it; write at most " +
         std::to_string(shm::kMaxHostName) +
         " letters, digits, '.', '-' and '_', as behind the --host of its link";
}

std::optional<NameProblem> find_problem_in_behaviour(std::string_view name) {
  if (auto problem = find_length_problem(name)) return problem;
  const std::size_t comma = name.find(',');
  if (comma == std::string_view::npos) return {};
  return NameProblem{"invalid-name",
                     "the name " + quote(name) +
                         " has a comma, which separates the names of an inhibition; remove it",
                     comma};
}

std::optional<std::string> find_similar(std::string_view name,
                                        const std::vector<std::string_view>& candidates) {
  if (name.empty() || name.size() > kMaxComparedLength) return {};
  const Compared typed = compared(name);
  // A short name is within two edits of anything; at least half of it must be right.
  const std::size_t most = std::min(kMaxEdits, typed.own.size() / 2);
  std::optional<std::string> best;
  std::tuple<std::size_t, bool, std::size_t> least;  // edits; another direction, another case
  for (const std::string_view candidate : candidates) {
    if (candidate.size() > kMaxComparedLength) continue;
    if (distance(name.size(), candidate.size()) > most + kMostAside) continue;
    const Compared other = compared(candidate);
    if (distance(typed.own.size(), other.own.size()) > most) continue;
    const std::size_t edits = count_edits(typed.own, other.own);
    if (edits > most) continue;
    const std::tuple now{edits, typed.direction != other.direction, count_edits(name, candidate)};
    if (best && least <= now) continue;
    least = now;
    best = std::string(candidate);
  }
  return best;
}

std::string advise(std::string_view name, const std::vector<std::string_view>& candidates,
                   std::string_view otherwise) {
  const auto similar = find_similar(name, candidates);
  return similar ? "; did you mean " + quote(*similar) + "?" : "; " + std::string(otherwise);
}

}  // namespace arbiter::rules
