// What `check --hosts` says that rules require of other hosts, against all states of random models.
#include <gtest/gtest.h>

#include <algorithm>
#include <ostream>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "rules/ask/across_hosts.hpp"
#include "rules/model/application_reader.hpp"
#include "tests/rules/model_text.hpp"
#include "tests/rules/ordered_rules.hpp"
#include "tests/rules/random_model.hpp"
#include "tests/support/live_table.hpp"
#include "tests/support/rounds.hpp"

namespace arbiter::test {
namespace {

const std::vector<std::string> kRemote = {"/a:o", "/b:o", "/c:o", "/d:o"};

struct Required {
  std::set<std::string> active, inactive;
  bool operator==(const Required&) const = default;
};

void PrintTo(const Required& required, std::ostream* out) {
  *out << "active " << testing::PrintToString(required.active) << ", inactive "
       << testing::PrintToString(required.inactive);
}

// A connection wins, and would not if only the source were not as it is.
Required by_definition(const Rules& rules) {
  Required result;
  for (const auto& now : subsets(kRemote)) {
    const auto winner = first_that_holds(rules, now);
    if (!winner) continue;
    for (const auto& source : kRemote) {
      auto then = now;
      const bool is_active = then.erase(source) != 0;
      if (!is_active) then.insert(source);
      if (first_that_holds(rules, then) == winner) continue;
      (is_active ? result.active : result.inactive).insert(source);
    }
  }
  return result;
}

Required by_check(const Rules& rules) {
  std::string xml = "<behaviors timeout='forever'><arbiter at='/p:i' conflict='first'>";
  for (const auto& [source, condition] : rules) {
    xml += "<select from='" + source + "'>" + written(*condition) + "</select>";
  }
  const rules::Loaded loaded = rules::load_text(xml + "</arbiter></behaviors>");
  std::string modules = "<application><module><name>p</name><node>here</node></module>";
  for (const char* name : {"a", "b", "c", "d"}) {
    modules += "<module><name>" + std::string(name) + "</name><node>there</node></module>";
  }
  rules::Diagnostics diagnostics;
  const rules::TextFile file("app.xml", modules + "</application>");
  const auto application = rules::read_application(file, diagnostics);
  const auto compiled = rules::compile(loaded.rules, diagnostics);
  EXPECT_FALSE(loaded.has_errors || diagnostics.has_errors()) << xml;
  const auto uses = rules::uses_of_sources(loaded.rules);
  const rules::HostPlaces places(loaded.rules, uses, application, "app.xml", diagnostics);
  rules::Budget budget;
  find_across_hosts(loaded.rules, compiled, uses, places, {}, diagnostics, budget);
  Required result;
  for (const auto& item : diagnostics.items()) {
    if (item.code == "remote-forever") result.active.insert(item.about.source);
    if (item.code == "negated-across-hosts") result.inactive.insert(item.about.source);
  }
  return result;
}

TEST(RandomHosts, RulesTriedInOrderRequireWhatDecidesWhoWins) {
  for (unsigned seed = 0; seed < rounds(300u); ++seed) {
    std::mt19937 random(seed);
    Rules rules;
    for (const auto& source : kRemote) {
      if (random() % 3 == 0) continue;
      rules.emplace_back(source, random_condition(random, 2, [](const auto& pick) {
                           const auto& name = kRemote[pick(kRemote.size())];
                           return pick(2) == 0 ? active(name) : inactive(name);
                         }));
    }
    std::shuffle(rules.begin(), rules.end(), random);
    if (rules.empty()) continue;
    const Required expected = by_definition(rules);
    ASSERT_EQ(by_check(rules), expected) << "seed " << seed;
  }
}

}  // namespace
}  // namespace arbiter::test
