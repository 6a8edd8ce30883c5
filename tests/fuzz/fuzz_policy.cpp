// A policy file, and a second, naive reader of it that must come to the same verdicts.
#include <array>
#include <optional>
#include <vector>

#include "service/policy/policy.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace arbiter::fuzz {
namespace {

using service::Action;
using service::Identity;
using service::Policy;

constexpr uid_t kOwner = 500;

// Every name of one letter is a user's or a group's.
std::optional<std::uint32_t> account(const std::string& name) {
  if (name.size() != 1 || name[0] < 'a' || name[0] > 'z') return {};
  return 1000u + static_cast<unsigned char>(name[0]);
}

bool glob_matches(std::string_view glob, std::string_view name) {
  if (glob.empty()) return name.empty();
  if (glob[0] != '*') {
    return !name.empty() && name[0] == glob[0] && glob_matches(glob.substr(1), name.substr(1));
  }
  for (std::size_t i = 0; i <= name.size(); ++i) {
    if (glob_matches(glob.substr(1), name.substr(i))) return true;
  }
  return false;
}

std::vector<std::string> words_of(std::string line) {
  std::istringstream stream(std::move(line));
  std::vector<std::string> words;
  for (std::string word; stream >> word && word[0] != '#';) words.push_back(word);
  return words;
}

constexpr auto kActions = std::to_array<const char*>(
    {"output", "input", "deactivate", "observe", "reload", "switch", "stop", "replay", "tap"});
static_assert(kActions.size() == service::kActionCount);

bool includes_action(const std::string& list, const std::string& action) {
  return list == "all" || ("," + list + ",").find("," + action + ",") != std::string::npos;
}

bool includes_user(std::vector<std::string>& words, const Identity& who) {
  const std::string kind = words.at(1);
  if (kind == "everyone") return true;
  if (kind == "owner") return who.user == kOwner;
  const std::string name = words.at(2);
  words.erase(words.begin() + 2);
  const std::uint32_t id =
      account(name) ? *account(name) : static_cast<std::uint32_t>(std::stoul(name));
  if (kind == "user") return who.user == id;
  return std::find(who.groups.begin(), who.groups.end(), id) != who.groups.end();
}

bool naive_may(const std::string& text, const Identity& who, std::size_t action,
               const std::string& port) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    auto words = words_of(line);
    if (words.empty()) continue;
    if (!includes_user(words, who) || !includes_action(words.at(2), kActions.at(action))) continue;
    bool matches = words.size() == 3;
    for (std::size_t i = 3; i < words.size(); ++i) matches |= glob_matches(words[i], port);
    if (matches) return words[0] == "allow";
  }
  return who.user == 0 || who.user == kOwner;
}

// The naive matcher takes for ever over many stars.
bool is_easy(const std::string& text) {
  return text.size() < 2'000 && std::count(text.begin(), text.end(), '*') < 12;
}

void check_policy(const std::string& text) {
  const rules::TextFile file("policy", text);
  rules::Diagnostics diagnostics;
  const Policy policy = Policy::parse(file, kOwner, {account, account}, diagnostics);
  check_findings(diagnostics);
  require(policy.size() <= Policy::kMaxRules, "the number of rules is bounded");
  if (diagnostics.has_errors()) return;
  require(policy.size() != 0, "a policy without rules is an error");
  const bool compare = is_easy(text);
  for (const Identity& who : {Identity{0, {0}}, Identity{kOwner, {}}, Identity{1097, {1098, 1099}},
                              Identity{1100, {1097}}, Identity{7, {7}}}) {
    for (std::size_t i = 0; i < service::kActionCount; ++i) {
      for (const char* port : {"/a", "/Arm/pos:o", "/*", "/a/b/a/b"}) {
        const auto verdict = policy.may(who, static_cast<Action>(i), port);
        require(!verdict.reason.empty() && verdict.reason.size() < 400, "a verdict has a reason");
        if (!compare) continue;
        require(verdict.allowed == naive_may(std::string(file.content()), who, i, port),
                "the first line that matches decides");
      }
    }
  }
}

}  // namespace
}  // namespace arbiter::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  arbiter::fuzz::check_policy(arbiter::fuzz::text_of(data, size));
  return 0;
}
