// Verdicts on random statements about random models, against all states.
#include <gtest/gtest.h>

#include <functional>

#include "rules/ask/verdict.hpp"
#include "rules/model/load.hpp"
#include "rules/model/statement.hpp"
#include "tests/rules/random_model.hpp"
#include "tests/support/live_table.hpp"
#include "tests/support/rounds.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

using rules::Verdict;
using Truth = std::function<bool(const NaiveEvaluator&, const Active&)>;

struct RandomStatement {
  std::string text;
  Truth truth;
};

// Text and meaning are made side by side; the meaning knows nothing of the parser.
class StatementGenerator {
 public:
  StatementGenerator(unsigned seed, const Vocabulary& words, const NaiveEvaluator& naive)
      : random_(seed), words_(words), naive_(naive) {}

  RandomStatement make(int depth) {
    if (depth == 0 || pick(5) == 0) return atom();
    if (pick(6) == 0) {
      const auto inner = make(depth - 1);
      return {"not (" + inner.text + ")",
              [=](const auto& naive, const auto& now) { return !inner.truth(naive, now); }};
    }
    const auto left = make(depth - 1), right = make(depth - 1);
    const auto both = [&](const std::string& word, auto combine) {
      return RandomStatement{"(" + left.text + ") " + word + " (" + right.text + ")",
                             [=](const auto& naive, const auto& now) {
                               return combine(left.truth(naive, now), right.truth(naive, now));
                             }};
    };
    switch (pick(5)) {
      case 0:
        return both("and", [](bool a, bool b) { return a && b; });
      case 1:
        return both("or", [](bool a, bool b) { return a || b; });
      case 2:
        return both("xor", [](bool a, bool b) { return a != b; });
      case 3:
        return both("iff", [](bool a, bool b) { return a == b; });
      default:
        return both("->", [](bool a, bool b) { return !a || b; });
    }
  }

 private:
  std::size_t pick(std::size_t n) { return random_() % n; }

  RandomStatement atom() {
    std::vector<std::string> ports;
    for (const auto& port : words_.ports) {
      if (!naive_.sources_at(port).empty()) ports.push_back(port);
    }
    const auto& port = ports[pick(ports.size())];
    const auto connected = naive_.sources_at(port);
    const auto& source = connected[pick(connected.size())];
    switch (pick(8)) {
      case 6:
        return one_of(port);
      case 7:
        return same(port, ports[pick(ports.size())]);
      case 0:
        return {"idle(" + port + ")", [=](const auto& naive, const auto& now) {
                  return !naive.winner(port, now).has_value();
                }};
      case 1:
        return {"winner(" + port + ") != none", [=](const auto& naive, const auto& now) {
                  return naive.winner(port, now).has_value();
                }};
      case 2:
        return {"winner(" + port + ") = " + source, [=](const auto& naive, const auto& now) {
                  return naive.winner(port, now) == source;
                }};
      case 3:
        return {"winner( " + port + ")!=" + source, [=](const auto& naive, const auto& now) {
                  return naive.winner(port, now) != source;
                }};
      case 4:
        return {"none(*)", [](const auto&, const auto& now) { return now.empty(); }};
      default:
        return {source, [=](const auto&, const auto& now) { return now.contains(source); }};
    }
  }

  // Sources are called /x:o, so that "/x*" is one and "*" is all.
  RandomStatement one_of(const std::string& port) {
    const bool is_all = pick(4) == 0, differs = pick(2) == 0;
    const std::string first = words_.sources[pick(words_.sources.size())].substr(0, 2);
    const std::string pattern = is_all ? "*" : first + "*";
    return {"winner(" + port + ") " + (differs ? "!=" : "=") + " any(" + pattern + ")",
            [=](const auto& naive, const auto& now) {
              const auto winner = naive.winner(port, now);
              return differs != (winner && (is_all || winner->starts_with(first)));
            }};
  }

  RandomStatement same(const std::string& port, const std::string& other) {
    const bool differs = pick(2) == 0;
    return {"winner(" + port + ") " + (differs ? "!=" : "=") + " winner(" + other + ")",
            [=](const auto& naive, const auto& now) {
              return differs != (naive.winner(port, now) == naive.winner(other, now));
            }};
  }

  std::mt19937 random_;
  const Vocabulary& words_;
  const NaiveEvaluator& naive_;
};

struct Counts {
  int proved = 0, refuted = 0;
};

void expect_verdict(const Verdict& verdict, const RandomStatement& statement,
                    const NaiveEvaluator& naive, const std::vector<Active>& states,
                    Counts& counts) {
  SCOPED_TRACE(statement.text);
  std::vector<Active> bad, good;
  for (const auto& now : states) (statement.truth(naive, now) ? good : bad).push_back(now);
  ASSERT_EQ(verdict.kind, bad.empty() ? Verdict::Kind::kProved : Verdict::Kind::kRefuted);
  ++(bad.empty() ? counts.proved : counts.refuted);
  if (bad.empty()) return;
  const auto refutes = [&](const rules::Witness& witness) {
    return std::none_of(good.begin(), good.end(),
                        [&](const auto& now) { return agrees(now, witness); });
  };
  const auto& witness = *verdict.witness;
  EXPECT_TRUE(refutes(witness));
  for (const auto side : {&rules::Witness::active, &rules::Witness::inactive}) {
    for (std::size_t i = 0; i < (witness.*side).size(); ++i) {
      rules::Witness less = witness;
      (less.*side).erase((less.*side).begin() + static_cast<std::ptrdiff_t>(i));
      EXPECT_FALSE(refutes(less));
    }
  }
  const Active alone(witness.active.begin(), witness.active.end());
  for (const auto& [port, winner] : verdict.winners) EXPECT_EQ(winner, naive.winner(port, alone));
}

TEST(RandomStatements, AreProvedOrRefutedAsAllStatesSay) {
  const Vocabulary words{
      {"/a:o", "/b:o", "/c:o", "/d:o", "/e:o", "/f:o", "/g:o"}, {"/p:i", "/q:i"}, 2, 7};
  const auto states = subsets(words.sources);
  Counts counts;
  for (unsigned seed = 0; seed < rounds(250u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const RandomModel random = Generator(seed, words).model();
    const TemporaryDirectory directory;
    rules::Diagnostics diagnostics;
    const auto path =
        directory.write("model.xml", to_xml(random, {words.ports.begin(), words.ports.end()}));
    auto set = rules::load({{path}, {}}, diagnostics);
    auto model = compile(set, diagnostics);
    ASSERT_FALSE(diagnostics.has_errors());
    model.sources = words.sources;  // so that quantifiers range over what is enumerated here
    const NaiveEvaluator naive(random);
    StatementGenerator generator(seed, words, naive);
    std::vector<RandomStatement> statements;
    std::string text = "# random statements\n";
    for (int i = 0; i < 8; ++i) {
      statements.push_back(generator.make(i % 4));
      text += statements.back().text + "  # " + std::to_string(i) + "\n";
    }
    const rules::TextFile file("s.txt", text);
    rules::Budget budget;
    const auto verdicts = judge(read_statements(file, diagnostics), model, diagnostics, budget);
    ASSERT_FALSE(diagnostics.has_errors()) << diagnostics.items().back().message;
    ASSERT_EQ(verdicts.size(), statements.size());
    for (std::size_t i = 0; i < verdicts.size(); ++i) {
      expect_verdict(verdicts[i], statements[i], naive, states, counts);
    }
    if (testing::Test::HasFailure()) break;
  }
  EXPECT_GT(counts.proved, rounds(50));
  EXPECT_GT(counts.refuted, rounds(500));
}

}  // namespace
}  // namespace arbiter::test
