// What check finds of models that compile, against all states of random models, by the definitions
// of docs/checking.md.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <regex>

#include "rules/ask/findings.hpp"
#include "rules/model/load.hpp"
#include "tests/rules/random_model.hpp"
#include "tests/support/live_table.hpp"
#include "tests/support/rounds.hpp"
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
      for (const auto& now : states_) winners.push_back(index_of(naive_.winner(port, now)));
    }
  }

  const std::vector<Active>& states() const { return states_; }

  // Connected, and there is a state in which it wins there.
  bool can_win(const std::string& port, const std::string& source) const {
    const auto& winners = winners_.at(port);
    return std::find(winners.begin(), winners.end(), index_of(source)) != winners.end();
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

  // Of the state of that number: a candidate is active, and nobody wins.
  bool is_of_nobody(const std::string& port, std::size_t state) const {
    return winners_.at(port)[state] == kNone && (state & candidates(port)) != 0;
  }

  // "port y  z": some x is silenced by y, which is silenced by z; or "port y cannot win z".
  std::set<std::string> chains(const std::string& port, bool lacks_z) const {
    std::set<std::string> result;
    const auto& winners = winners_.at(port);
    const auto count = static_cast<int>(words_.sources.size());
    for (std::size_t state = 0; state < states_.size(); ++state) {
      if (!is_of_nobody(port, state)) continue;
      const auto would_win = [&](int source, int other, bool with_other) {
        const auto then = with_other ? state | bit(other) : state & ~bit(other);
        return source != other && winners[then] == source;
      };
      for (int y = 0; y < count; ++y) {
        if ((state & candidates(port) & bit(y)) == 0) continue;
        for (int z = 0; z < count; ++z) {
          if (((state & bit(z)) == 0) != lacks_z || !would_win(y, z, lacks_z)) continue;
          for (int x = 0; x < count; ++x) {
            if (x == z || (state & bit(x)) == 0 || !would_win(x, y, false)) continue;
            result.insert(port + " " + words_.sources[static_cast<std::size_t>(y)] +
                          (lacks_z ? " cannot win " : "  ") +
                          words_.sources[static_cast<std::size_t>(z)]);
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
      const auto& winners = winners_.at(port);
      for (std::size_t state = 0; state < states_.size(); ++state) {
        if (winners[state] != index_of(source)) continue;
        if (naive_.may_run_at(behaviour, port, states_[state])) return true;
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

  static std::size_t bit(int source) { return std::size_t{1} << source; }

  int index_of(const std::optional<std::string>& source) const {
    const auto found = std::find(words_.sources.begin(), words_.sources.end(), source);
    return found == words_.sources.end() ? kNone : static_cast<int>(found - words_.sources.begin());
  }

  std::size_t candidates(const std::string& port) const {
    auto& candidates = candidates_[port];
    if (!candidates) {
      candidates = 0;
      for (const int winner : winners_.at(port)) {
        if (winner != kNone) *candidates |= bit(winner);
      }
    }
    return *candidates;
  }

  const RandomModel& model_;
  const Vocabulary& words_;
  const NaiveEvaluator naive_;
  const std::vector<Active> states_;                 // by number: bit i stands for source i
  std::map<std::string, std::vector<int>> winners_;  // by state; kNone: nobody
  mutable std::map<std::string, std::optional<std::size_t>> candidates_;
};

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
  int compared = 0, never_runs = 0, unreachable = 0, never_wins = 0, nobody = 0, chains = 0,
      lacking = 0;
};

void compare(const RandomModel& random, const Vocabulary& words,
             const std::set<std::string>& first_wins_at, Seen& seen) {
  const TemporaryDirectory directory;
  rules::Diagnostics diagnostics;
  const auto path = directory.write("model.xml", to_xml(random, first_wins_at));
  const auto set = rules::load({{path}, {}}, diagnostics);
  const auto model = compile(set, diagnostics);
  if (diagnostics.has_errors()) return;
  rules::Budget budget;
  const auto account = find_more(set, model, diagnostics, budget);
  EXPECT_EQ(account.open, 0u);
  ++seen.compared;
  const auto& items = diagnostics.items();
  const ExhaustiveFindings expected(random, words);

  const auto never_runs = first_matches(items, "never-runs", "the behaviour \"([^\"]*)\"");
  EXPECT_EQ(never_runs, expected.never_runs());
  seen.never_runs += static_cast<int>(never_runs.size());
  const auto unreachable =
      first_matches(items, "unreachable-children", "child(?:ren)? of \"([^\"]*)\"");
  EXPECT_EQ(unreachable, expected.with_unreachable_children());
  seen.unreachable += static_cast<int>(unreachable.size());

  std::set<std::string> losers, connected;
  std::map<std::string, int> connections;
  for (const auto& port : set.ports) {
    for (const auto& rule : port.rules) ++connections[rule.source];
  }
  for (const auto& each : connections) {
    const std::string& source = each.first;
    const auto wins = [&](const auto& port) { return expected.can_win(port, source); };
    if (std::any_of(words.ports.begin(), words.ports.end(), wins)) continue;
    if (each.second > 1) losers.insert(source);
  }
  EXPECT_EQ(first_matches(items, "never-wins", "^(\\S+) is connected to"), losers);
  seen.never_wins += static_cast<int>(losers.size());

  std::set<std::string> nobody;
  for (const auto& port : words.ports) {
    for (std::size_t state = 0; state < expected.states().size(); ++state) {
      if (expected.is_of_nobody(port, state)) nobody.insert(port);
    }
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
    auto causes = item.more_witnesses;
    causes.push_back(*item.witness);
    const bool are_all =
        item.code == "nobody-wins" && item.message.find("are listed") == std::string::npos;
    for (std::size_t state = 0; state < expected.states().size(); ++state) {
      const auto covers = [&](const auto& cause) {
        return agrees(expected.states()[state], cause);
      };
      const bool is_covered = std::any_of(causes.begin(), causes.end(), covers);
      const bool is_of_nobody = expected.is_of_nobody(port, state);
      EXPECT_TRUE(is_of_nobody || !is_covered);
      EXPECT_TRUE(is_covered || !are_all || !is_of_nobody);
    }
  }

  const auto found = first_matches(items, "starved",
                                   "at (\\S+), (\\S+) silences .* even while "
                                   "(?:\\S+ (cannot win) for want of )?(\\S+)(?: silences|:)");
  for (const auto& port : words.ports) {
    std::size_t left = 4;
    for (const bool lacks_z : {false, true}) {
      const auto all = expected.chains(port, lacks_z);
      std::set<std::string> here;
      for (const auto& chain : found) {
        const bool is_of_these = (chain.find("cannot win") != std::string::npos) == lacks_z;
        if (is_of_these && chain.starts_with(port + " ")) here.insert(chain);
      }
      EXPECT_TRUE(std::includes(all.begin(), all.end(), here.begin(), here.end()));
      EXPECT_EQ(here.size(), std::min(all.size(), left));
      left -= here.size();
      (lacks_z ? seen.lacking : seen.chains) += static_cast<int>(here.size());
    }
  }
}

TEST(RandomFindings, AreThoseOfAllStates) {
  const Vocabulary words{
      {"/a:o", "/b:o", "/c:o", "/d:o", "/e:o", "/f:o", "/g:o"}, {"/p:i", "/q:i"}, 2, 7};
  Seen seen;
  for (unsigned seed = 0; seed < rounds(600u); ++seed) {
    const RandomModel random = Generator(seed, words).model();
    const std::set<std::string> first_wins_at =
        seed % 2 == 0 ? std::set<std::string>{"/p:i", "/q:i"} : std::set<std::string>{};
    SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + to_xml(random, first_wins_at));
    compare(random, words, first_wins_at, seen);
    if (testing::Test::HasFailure()) break;
  }
  EXPECT_GT(seen.compared, rounds(300));
  EXPECT_GT(seen.never_runs, rounds(50));
  EXPECT_GT(seen.unreachable, rounds(20));
  EXPECT_GT(seen.never_wins, rounds(5));
  EXPECT_GT(seen.nobody, rounds(300));
  EXPECT_GT(seen.chains, rounds(50));
  EXPECT_GT(seen.lacking, rounds(50));
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
