// What check finds of models that compile, against all states of random models, by the definitions
// of docs/checking.md.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <regex>

#include "rules/findings.hpp"
#include "rules/load.hpp"
#include "tests/rules/random_model.hpp"
#include "tests/support/live_table.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

using rules::Diagnostic;

class ExhaustiveFindings {
 public:
  ExhaustiveFindings(const RandomModel& model, const Vocabulary& words)
      : model_(model), words_(words), naive_(model), states_(subsets(words.sources)) {
    for (const auto& port : words.ports) {
      auto& winners = winners_[port];
      for (const auto& now : states_) winners.emplace(now, naive_.winner(port, now));
    }
  }

  const std::vector<Active>& states() const { return states_; }
  std::optional<std::string> winner(const std::string& port, const Active& now) const {
    return winners_.at(port).at(now);
  }

  // Connected, and there is a state in which it wins there.
  bool can_win(const std::string& port, const std::string& source) const {
    const auto& winners = winners_.at(port);
    return std::any_of(winners.begin(), winners.end(),
                       [&](const auto& each) { return each.second == source; });
  }

  std::set<std::string> never_runs() const {
    std::set<std::string> result;
    for (std::size_t i = 0; i < model_.elements.size(); ++i) {
      const auto& element = model_.elements[i];
      if (element.children.empty() && !runs(static_cast<int>(i))) {
        result.insert(name_of(static_cast<int>(i)));
      }
    }
    return result;
  }

  std::set<std::string> with_unreachable_children() const {
    std::set<std::string> result;
    for (std::size_t i = 0; i < model_.elements.size(); ++i) {
      for (const int child : model_.elements[i].children) {
        if (!is_reached(child)) result.insert(name_of(static_cast<int>(i)));
      }
    }
    return result;
  }

  bool is_of_nobody(const std::string& port, const Active& now) const {
    if (winner(port, now)) return false;
    return std::any_of(now.begin(), now.end(),
                       [&](const auto& source) { return can_win(port, source); });
  }

  // "port y z": some x is silenced by y, which is silenced by z.
  std::set<std::string> chains(const std::string& port) const {
    std::set<std::string> result;
    for (const auto& now : states_) {
      if (winner(port, now)) continue;
      const auto would_win = [&](const std::string& source, const std::string& without) {
        Active other = now;
        other.erase(without);
        return source != without && winner(port, other) == source;
      };
      for (const auto& x : now) {
        for (const auto& y : now) {
          if (x == y || !can_win(port, y) || !would_win(x, y)) continue;
          for (const auto& z : now) {
            if (z != x && would_win(y, z)) result.insert(port + " " + y + " " + z);
          }
        }
      }
    }
    return result;
  }

 private:
  bool runs(int behaviour) const {
    for (const auto& [port, source] :
         model_.elements[static_cast<std::size_t>(behaviour)].configs) {
      for (const auto& now : states_) {
        if (winner(port, now) == source && naive_.may_run_at(behaviour, port, now)) return true;
      }
    }
    return false;
  }

  bool is_reached(int element) const {
    const auto& children = model_.elements[static_cast<std::size_t>(element)].children;
    if (children.empty()) return runs(element);
    return std::any_of(children.begin(), children.end(),
                       [&](const int child) { return is_reached(child); });
  }

  const RandomModel& model_;
  const Vocabulary& words_;
  const NaiveEvaluator naive_;
  const std::vector<Active> states_;
  std::map<std::string, std::map<Active, std::optional<std::string>>> winners_;
};

bool agrees(const Active& now, const rules::Witness& witness) {
  const auto is_active = [&](const auto& source) { return now.contains(source); };
  return std::all_of(witness.active.begin(), witness.active.end(), is_active) &&
         std::none_of(witness.inactive.begin(), witness.inactive.end(), is_active);
}

std::set<std::string> first_matches(const std::vector<Diagnostic>& items, const std::string& code,
                                    const std::string& pattern) {
  std::set<std::string> result;
  for (const auto& item : items) {
    std::smatch match;
    if (item.code != code) continue;
    EXPECT_TRUE(std::regex_search(item.message, match, std::regex(pattern))) << item.message;
    std::string found = match[1];
    for (std::size_t i = 2; i < match.size(); ++i) found += " " + match[i].str();
    EXPECT_TRUE(result.insert(found).second) << item.message;
  }
  return result;
}

struct Seen {
  int compared = 0, never_runs = 0, unreachable = 0, never_wins = 0, nobody = 0, chains = 0;
};

void compare(const RandomModel& random, const Vocabulary& words,
             const std::set<std::string>& first_wins_at, Seen& seen) {
  const TemporaryDirectory directory;
  rules::Diagnostics diagnostics;
  const auto path = directory.write("model.xml", to_xml(random, first_wins_at));
  const auto set = rules::load({{path}, {}}, diagnostics);
  const auto model = compile(set, diagnostics);
  if (diagnostics.has_errors()) return;
  const auto account = find_more(set, model, diagnostics);
  EXPECT_EQ(account.open, 0u);
  ++seen.compared;
  const auto& items = diagnostics.items();
  const ExhaustiveFindings expected(random, words);

  const auto never_runs = first_matches(items, "never-runs", "the behaviour \"([^\"]*)\"");
  EXPECT_EQ(never_runs, expected.never_runs());
  seen.never_runs += static_cast<int>(never_runs.size());
  const auto unreachable = first_matches(items, "unreachable-children", "child(?:ren)? of \"([^\"]*)\"");
  EXPECT_EQ(unreachable, expected.with_unreachable_children());
  seen.unreachable += static_cast<int>(unreachable.size());

  std::set<std::string> losers, connected;
  std::map<std::string, int> connections;
  for (const auto& port : set.ports) {
    for (const auto& rule : port.rules) ++connections[rule.source];
  }
  for (const auto& [source, count] : connections) {
    const auto wins = [&](const auto& port) { return expected.can_win(port, source); };
    if (std::any_of(words.ports.begin(), words.ports.end(), wins)) continue;
    if (count > 1) losers.insert(source);
  }
  EXPECT_EQ(first_matches(items, "never-wins", "^(\\S+) is connected to"), losers);
  seen.never_wins += static_cast<int>(losers.size());

  std::set<std::string> nobody;
  for (const auto& port : words.ports) {
    const auto is_it = [&](const auto& now) { return expected.is_of_nobody(port, now); };
    if (std::any_of(expected.states().begin(), expected.states().end(), is_it)) nobody.insert(port);
  }
  const std::string at_port = "nobody wins at (\\S+) although";
  EXPECT_EQ(first_matches(items, "nobody-wins", at_port), nobody);
  seen.nobody += static_cast<int>(nobody.size());
  for (const auto& item : items) {
    if (item.code != "nobody-wins" && item.code != "starved") continue;
    std::smatch match;
    ASSERT_TRUE(std::regex_search(item.message, match, std::regex("at (/[pq]:i)")));
    const std::string port = match[1];
    ASSERT_TRUE(item.witness.has_value());
    for (const auto& now : expected.states()) {
      EXPECT_TRUE(!agrees(now, *item.witness) || expected.is_of_nobody(port, now));
    }
  }

  const auto found =
      first_matches(items, "starved", "at (\\S+), (\\S+) silences .* even while (\\S+) silences ");
  for (const auto& port : words.ports) {
    const auto all = expected.chains(port);
    std::set<std::string> here;
    for (const auto& chain : found) {
      if (chain.starts_with(port + " ")) here.insert(chain);
    }
    EXPECT_TRUE(std::includes(all.begin(), all.end(), here.begin(), here.end()));
    EXPECT_EQ(here.size(), std::min<std::size_t>(all.size(), 4));
    seen.chains += static_cast<int>(here.size());
  }
}

TEST(RandomFindings, AreThoseOfAllStates) {
  const Vocabulary words{
      {"/a:o", "/b:o", "/c:o", "/d:o", "/e:o", "/f:o", "/g:o"}, {"/p:i", "/q:i"}, 2, 7};
  Seen seen;
  for (unsigned seed = 0; seed < 600; ++seed) {
    const RandomModel random = Generator(seed, words).model();
    const std::set<std::string> first_wins_at =
        seed % 2 == 0 ? std::set<std::string>{"/p:i", "/q:i"} : std::set<std::string>{};
    SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + to_xml(random, first_wins_at));
    compare(random, words, first_wins_at, seen);
    if (testing::Test::HasFailure()) break;
  }
  EXPECT_GT(seen.compared, 300);
  EXPECT_GT(seen.never_runs, 50);
  EXPECT_GT(seen.unreachable, 20);
  EXPECT_GT(seen.never_wins, 5);
  EXPECT_GT(seen.nobody, 300);
  EXPECT_GT(seen.chains, 50);
}

TEST(RandomFindings, AreThoseOfAllStatesOfTenSources) {
  const Vocabulary words{
      {"/a:o", "/b:o", "/c:o", "/d:o", "/e:o", "/f:o", "/g:o", "/h:o", "/i:o", "/j:o"},
      {"/p:i", "/q:i"},
      6,
      12};
  Seen seen;
  for (unsigned seed = 0; seed < 12; ++seed) {
    const RandomModel random = Generator(seed, words).model();
    SCOPED_TRACE("seed " + std::to_string(seed));
    compare(random, words, {"/p:i", "/q:i"}, seen);
  }
  EXPECT_EQ(seen.compared, 12);
}

}  // namespace
}  // namespace arbiter::test
