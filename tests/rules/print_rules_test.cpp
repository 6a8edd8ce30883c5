#include "rules/model/print_rules.hpp"

#include <gtest/gtest.h>

#include <sstream>

#include <nlohmann/json.hpp>

#include "tests/rules/rules_by_hand.hpp"

namespace arbiter::test {
namespace {

const auto is_a = active("/a"), is_b = active("/b"), is_c = active("/c");

std::string text_of(const rules::RuleSet& set) {
  std::ostringstream out;
  write_rules(out, set);
  return out.str();
}

TEST(PrintRules, WritesAPortsRulesAsThePaperDoes) {
  EXPECT_EQ(text_of(RulesByHand().port("/Gaze/pos:i", {{"/Face/pos:o", inactive("/Object/pos:o")},
                                                       {"/Object/pos:o", always()}})),
            "/Gaze/pos:i\n"
            "  /Face/pos:o ∧ ¬/Object/pos:o ⇒ Select(/Face/pos:o)\n"
            "  /Object/pos:o ⇒ Select(/Object/pos:o)\n");
}

TEST(PrintRules, SaysTheOwnSourceOnceAndFirst) {
  const rules::ConnectionRule rule{
      "/a", all_of({inactive("/b"), is_a, always(), inactive("/b")}), {}, {}};
  EXPECT_EQ(to_string(rule), "/a ∧ ¬/b");
}

TEST(PrintRules, KeepsParenthesesWhereADisjunctionIsOneOfSeveralConditions) {
  const rules::ConnectionRule rule{"/a", any_of({is_b, inactive("/c")}), {}, {}};
  EXPECT_EQ(to_string(rule), "/a ∧ (/b ∨ ¬/c)");
}

TEST(PrintRules, PutsParenthesesOnlyWhereThePrecedencesAskForThem) {
  const auto iff = [](auto x, auto y) { return binary(Operator::kIff, x, y); };
  const auto implies = [](auto x, auto y) { return binary(Operator::kImplies, x, y); };
  const auto exclusive = [](auto x, auto y) { return binary(Operator::kXor, x, y); };
  EXPECT_EQ(to_string(*any_of({all_of({is_a, is_b}), is_c})), "/a ∧ /b ∨ /c");
  EXPECT_EQ(to_string(*all_of({any_of({is_a, is_b}), is_c})), "(/a ∨ /b) ∧ /c");
  EXPECT_EQ(to_string(*negation(all_of({is_a, is_b}))), "¬(/a ∧ /b)");
  EXPECT_EQ(to_string(*negation(negation(is_a))), "¬¬/a");
  EXPECT_EQ(to_string(*implies(is_a, implies(is_b, is_c))), "/a → /b → /c");
  EXPECT_EQ(to_string(*implies(implies(is_a, is_b), is_c)), "(/a → /b) → /c");
  EXPECT_EQ(to_string(*iff(iff(is_a, is_b), is_c)), "/a ↔ /b ↔ /c");
  EXPECT_EQ(to_string(*iff(is_a, iff(is_b, is_c))), "/a ↔ (/b ↔ /c)");
  EXPECT_EQ(to_string(*iff(implies(is_a, is_b), any_of({is_b, is_c}))), "/a → /b ↔ /b ∨ /c");
  EXPECT_EQ(to_string(*any_of({exclusive(is_a, is_b), is_c})), "/a xor /b ∨ /c");
  EXPECT_EQ(to_string(*exclusive(any_of({is_a, is_b}), all_of({is_b, is_c}))),
            "(/a ∨ /b) xor /b ∧ /c");
  EXPECT_EQ(to_string(*exclusive(is_a, exclusive(is_b, is_c))), "/a xor (/b xor /c)");
  EXPECT_EQ(to_string(*exclusive(exclusive(is_a, is_b), is_c)), "/a xor /b xor /c");
  EXPECT_EQ(to_string(*all_of({})), "true");
  EXPECT_EQ(to_string(*any_of({})), "false");
  EXPECT_EQ(to_string(*negation(any_of({all_of({is_a})}))), "¬/a");
}

TEST(PrintRules, QuotesNamesThatAConditionCouldNotTakeOtherwise) {
  EXPECT_EQ(to_string(*active("/left,arm/pos:o")), "\"/left,arm/pos:o\"");
  EXPECT_EQ(to_string(*active("/Kopf/größe:o")), "\"/Kopf/größe:o\"");
  EXPECT_EQ(to_string(*active("/icub/head_0.5-b:o")), "/icub/head_0.5-b:o");
}

TEST(PrintRules, MarksWhatIsNotAnOrdinaryRule) {
  EXPECT_EQ(text_of(RulesByHand()
                        .port("/p", {{"/a", always()}, {"/b", always()}}, true)
                        .other("/x", "/p")
                        .other("/x", "/q")),
            "/p  (conflict=\"first\": the first that holds)\n"
            "  /a ⇒ Select(/a)\n"
            "  /b ⇒ Select(/b)\n"
            "  /x  (no rule: never delivers)\n"
            "/q  (no rule: delivers everything)\n"
            "  /x\n");
}

TEST(PrintRules, WritesJson) {
  std::ostringstream out;
  rules::write_rules_json(out, RulesByHand()
                                   .port("/p", {{"/a", inactive("/b")}})
                                   .behaviour("First", "/p", "/a", always())
                                   .behaviour("Second", "/p", "/a", always())
                                   .other("/x", "/p")
                                   .other("/x", "/q")
                                   .timeout("/b", shm::kForever));
  const auto expected = nlohmann::json::parse(R"({
    "timeout": "500ms", "timeouts": {"/b": "forever"},
    "ports": [
      {"port": "/p", "arbitrated": true, "conflict": "error", "connections": [
        {"source": "/a", "rule": "/a ∧ ¬/b", "behaviours": ["First", "Second"]},
        {"source": "/x", "rule": null, "behaviours": []}]},
      {"port": "/q", "arbitrated": false, "conflict": "error", "connections": [
        {"source": "/x", "rule": null, "behaviours": []}]}]})");
  EXPECT_EQ(nlohmann::json::parse(out.str()), expected);
}

}  // namespace
}  // namespace arbiter::test
