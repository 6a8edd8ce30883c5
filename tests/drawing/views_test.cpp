#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "drawing/drawing.hpp"
#include "tests/rules/model_text.hpp"

namespace arbiter::drawing {
namespace {

using rules::Folder;
using testing::HasSubstr;
using testing::Not;

rules::LoadedModel load(const std::string& model, const std::string& application = {}) {
  const Folder folder;
  rules::Diagnostics diagnostics;
  rules::ModelFiles files{{folder.write("a.xml", model)}, {}};
  if (!application.empty()) files.application = folder.write("app.xml", application);
  auto loaded = rules::load_all(rules::read_texts(files), diagnostics);
  EXPECT_FALSE(diagnostics.has_errors());
  return loaded;
}

const std::string kNested = R"(<behaviors>
  <meta_behavior name="Outer"><behavior>Inner</behavior><behavior>C</behavior></meta_behavior>
  <meta_behavior name="Inner"><behavior>A</behavior><behavior>B</behavior>
    <condition>/x</condition></meta_behavior>
  <behavior name="A"><config at="/P/in">/a</config><inhibition>B</inhibition></behavior>
  <behavior name="B"><config at="/P/in">/b</config></behavior>
  <behavior name="C"><config at="/P/in">/c</config><inhibition>Inner</inhibition></behavior>
</behaviors>)";

TEST(BehavioursView, PutsBehavioursIntoTheBoxesOfTheirMetaBehaviours) {
  const std::string dot = draw(load(kNested), View::kBehaviours);
  // Outer { Inner { A B } C }, by the order of what is opened and closed.
  const auto at = [&](const std::string& text) {
    EXPECT_THAT(dot, HasSubstr(text));
    return dot.find(text);
  };
  const std::vector<std::size_t> order{at("  subgraph cluster_b0 {\n"),
                                       at("    subgraph cluster_b1 {\n"), at("      b2 ["),
                                       at("      b3 ["), at("\n    b4 [") + 1};
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
  EXPECT_THAT(dot, HasSubstr("if /x"));
}

TEST(BehavioursView, ArrowsLeadFromInhibitorsToTheInhibitedAndEndAtTheirBoxes) {
  const std::string dot = draw(load(kNested), View::kBehaviours);
  EXPECT_THAT(dot, HasSubstr("b2 -> b3 [color=\"#C8102E\" penwidth=1.8"));
  EXPECT_THAT(dot, HasSubstr("b4 -> b2 [color=\"#C8102E\" penwidth=1.8 lhead=cluster_b1 "));
  EXPECT_THAT(dot, HasSubstr("C inhibits Inner, "));
}

TEST(BehavioursView, AModelOfRulesByHandHasNone) {
  const auto loaded = load("<arbiter at='/p'><select from='/a'/></arbiter>");
  EXPECT_EQ(natural_view(loaded), View::kConnections);
  EXPECT_EQ(natural_view(load(kNested)), View::kBehaviours);
}

TEST(ConnectionsView, ShowsWhatIsSelectedWhatIsNotAndWhatIsSensed) {
  const std::string dot = draw(load(R"(<arbiter at="/P/in:i">
      <select from="/A/out:o">not /S/on:o</select></arbiter>)",
                                    R"(<application>
      <connection><from>/A/out:o</from><to>/P/in:i</to></connection>
      <connection><from>/B/out:o</from><to>/P/in:i</to></connection>
      <connection><from>/A/out:o</from><to>/Q/in:i</to></connection></application>)"),
                               View::kConnections);
  EXPECT_THAT(dot, HasSubstr("/B/out:o: no rule, never delivers"));
  EXPECT_THAT(dot, HasSubstr("/B/out:o → /P/in:i\\nno rule selects it"));
  EXPECT_THAT(dot, HasSubstr("/A/out:o → /Q/in:i\\nnot arbitrated"));
  EXPECT_THAT(dot, HasSubstr("/S/on:o is sensed at /P/in:i"));
  EXPECT_THAT(dot, Not(HasSubstr("/A/out:o is sensed")));
}

TEST(ConnectionsView, PutsThePortsOfAComponentTogether) {
  const std::string dot = draw(load(R"(<behaviors>
      <behavior name="A"><config at="/Robot/in:i">/Robot/out:o</config></behavior>
      <behavior name="B"><config at="/plain:i">/single:o</config></behavior></behaviors>)"),
                               View::kConnections);
  EXPECT_THAT(dot, HasSubstr("c0 [tooltip=\"Robot\""));
  EXPECT_THAT(dot, HasSubstr("c1 [tooltip=\"plain\""));
  EXPECT_THAT(dot, HasSubstr("c2 [tooltip=\"single\""));
  EXPECT_THAT(dot, Not(HasSubstr("c3 [")));
  EXPECT_THAT(dot, HasSubstr("c0:o1:e -> c0:i0r0:w"));
}

// Graphviz takes no empty title.
TEST(ConnectionsView, APortThatIsCalledOnlyASlashHasAComponentOfThatName) {
  const std::string dot = draw(load(R"(<behaviors>
      <behavior name="A"><config at="/">/s:o</config></behavior></behaviors>)"),
                               View::kConnections);
  EXPECT_THAT(dot, HasSubstr("<B>/</B>"));
}

// By inhibition across ports, each behaviour of a large model may matter to each port.
TEST(ConnectionsView, SourcesThatAreOnlySensedShareARowWhereTheyAreMany) {
  std::string rules, condition = "not /Sensor0:o";
  for (int i = 1; i < 40; ++i) condition += " and not /Sensor" + std::to_string(i) + ":o";
  for (int i = 0; i < 20; ++i) {
    rules += "<arbiter at='/P" + std::to_string(i) + "/in:i'><select from='/A" + std::to_string(i) +
             "/out:o'>" + condition + "</select></arbiter>";
  }
  const auto loaded = load("<behaviors>" + rules + "</behaviors>");
  const std::string dot = draw(loaded, View::kConnections);
  EXPECT_THAT(dot, HasSubstr("and 35 more, only sensed"));
  EXPECT_THAT(dot, HasSubstr("/Sensor39:o is sensed at /P0/in:i"));
  const Situation now = decide(loaded.rules, {"/Sensor39:o"});
  EXPECT_THAT(draw(loaded, View::kConnections, {}, &now), HasSubstr("● /Sensor39:o"));
}

// Ten thousand behaviours, a thousand boxes in each other: large, but no trouble.
TEST(Views, OfLargeModelsAreDrawnToo) {
  std::string model = "<behaviors>";
  for (int i = 0; i < 900; ++i) {
    const std::string n = std::to_string(i);
    model += "<meta_behavior name='M" + n + "'><behavior>B" + n + "</behavior>" +
             (i < 899 ? "<behavior>M" + std::to_string(i + 1) + "</behavior>" : "") +
             "</meta_behavior><behavior name='B" + n + "'><config at='/p" + n + "'>/s" + n +
             "</config></behavior>";
  }
  for (int i = 0; i < 3000; ++i) {
    const std::string n = std::to_string(i);
    model += "<behavior name='L" + n + "'><config at='/q" + n + "'>/t" + n + "</config>" +
             (i < 2999 ? "<inhibition>L" + std::to_string(i + 1) + "</inhibition>" : "") +
             "</behavior>";
  }
  const auto loaded = load(model + "</behaviors>");
  const std::string dot = draw(loaded, View::kBehaviours);
  EXPECT_THAT(dot, HasSubstr("L2998 inhibits L2999"));
  EXPECT_LT(dot.size(), 20u << 20);
}

}  // namespace
}  // namespace arbiter::drawing
