// What rules require, by what they mean; and what is said of a source in place of an input port.
#include "rules/ask/dependence.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "rules/ask/source_as_port.hpp"
#include "rules/prove/compile.hpp"
#include "tests/rules/model_text.hpp"

namespace arbiter::rules {
namespace {

CompiledModel compiled_of(const std::string& model) {
  Diagnostics diagnostics;
  CompiledModel result = compile(load_text(model).rules, diagnostics);
  EXPECT_FALSE(diagnostics.has_errors());
  return result;
}

// "+" where /a at /p needs /m to be active, "-" where it needs it to be inactive.
std::string needs_under(const std::string& condition, std::uint64_t steps = Budget::kSteps) {
  const CompiledModel model =
      compiled_of("<behavior name='A'><config at='/p'>/a</config><condition>" + condition +
                  "</condition></behavior>");
  Budget budget(steps);
  Dependence dependence(model.ports.at(0), budget);
  return std::string(dependence.needs("/a", "/m", true) ? "+" : "") +
         (dependence.needs("/a", "/m", false) ? "-" : "");
}

TEST(Dependence, IsOfWhatRulesMeanAndNotOfHowTheyAreWritten) {
  for (const auto& [condition, needs] : std::vector<std::pair<std::string, std::string>>{
           {"/m", "+"},
           {"not /m", "-"},
           {"/m or not /m", ""},
           {"/m -> /a", ""},  // the connection's own source is active where it wins
           {"/a or (/m xor /x)", ""},
           {"(/m and /x) or (not /m and /x)", ""},
           {"(/m and /x) or not /m", "-"},
           {"(/m and /x) or (not /x and /y)", "+"},
           {"/m xor /x", "+-"},
           {"/x and not /x and not /m", ""}}) {  // it never wins
    EXPECT_EQ(needs_under(condition), needs) << condition;
  }
  EXPECT_EQ(needs_under("/m xor /x", 1), "+-") << "as it is written where there are no steps";
}

TEST(Dependence, AtAPortInOrderThoseBeforeHaveAPart) {
  const CompiledModel model = compiled_of(
      "<arbiter at='/p' conflict='first'><select from='/m'>/x</select>"
      "<select from='/a'/></arbiter>");
  Budget budget;
  Dependence dependence(model.ports.at(0), budget);
  EXPECT_TRUE(dependence.needs("/a", "/m", false));
  EXPECT_TRUE(dependence.needs("/a", "/x", false));
  EXPECT_FALSE(dependence.needs("/a", "/m", true));
  EXPECT_TRUE(dependence.needs("/m", "/m", true));
}

TEST(SourceAsPort, TheNearestNameSaysWhatIsAskedFor) {
  const Loaded loaded = load_text(
      "<behavior name='A'><config at='/Gaze/pos:i'>/Face/pos:o</config>"
      "<condition>not /collision:o</condition></behavior>");
  const auto about = [&](const std::string& name) {
    const auto instead = [](const std::string& port, const std::string& source) {
      return "ask " + port + " " + source;
    };
    return about_no_port({name, "no port " + name, instead}, loaded.rules);
  };
  EXPECT_EQ(about("/Gaze/ps:i"), "no port /Gaze/ps:i; did you mean \"/Gaze/pos:i\"?");
  EXPECT_EQ(about("/Face/pos:o"),
            "/Face/pos:o is an output port, connected to /Gaze/pos:i; give the input port first: "
            "ask /Gaze/pos:i /Face/pos:o");
  EXPECT_EQ(about("/colision:o"),
            "no port /colision:o; did you mean the output port \"/collision:o\", read at "
            "/Gaze/pos:i? Then give the input port first: ask /Gaze/pos:i /collision:o");
  EXPECT_EQ(about("/nix"), "no port /nix; `arbiter rules` shows the input ports");
}

}  // namespace
}  // namespace arbiter::rules
