#include "rules/model/hierarchy.hpp"

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "tests/rules/model_text.hpp"

namespace arbiter::rules {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// "A" is a behaviour, "A>B,C" inhibits, "M[A B]" is a meta-behaviour; one on each line of the file.
std::string model(const std::vector<std::string>& behaviours) {
  std::string result;
  for (const std::string& behaviour : behaviours) {
    const std::size_t arrow = behaviour.find('>');
    const std::size_t bracket = behaviour.find('[');
    const std::string name = behaviour.substr(0, std::min(arrow, bracket));
    std::string inside;
    if (bracket == std::string::npos) {
      inside = "<config at='/p'>/" + name + "</config>";
    } else {
      std::string children = behaviour.substr(bracket + 1, behaviour.find(']') - bracket - 1);
      while (!children.empty()) {
        const std::size_t end = std::min(children.find(' '), children.size());
        inside += "<behavior>" + children.substr(0, end) + "</behavior>";
        children.erase(0, end + 1);
      }
    }
    if (arrow != std::string::npos) {
      inside += "<inhibition>" + behaviour.substr(arrow + 1) + "</inhibition>";
    }
    const std::string tag = bracket == std::string::npos ? "behavior" : "meta_behavior";
    result += "<" + tag + " name='" + name + "'>" + inside + "</" + tag + ">\n";
  }
  return result;
}

TEST(Hierarchy, SiblingsMayInhibitEachOther) {
  for (const std::vector<std::string>& behaviours : std::vector<std::vector<std::string>>{
           {"A>B", "B"},
           {"A>B", "B>A"},
           {"M[A B]", "A>B", "B"},
           {"A>B", "B", "M[A B]"},
           {"M[A]>B", "A", "B"},
           {"M[A]", "B>M", "A"},
           {"M[A]>N", "N[B]", "A", "B"},
           {"M[N B]", "N[A]>B", "A", "B"},
       }) {
    EXPECT_THAT(load_text(model(behaviours)).findings(), IsEmpty()) << model(behaviours);
  }
}

TEST(Hierarchy, OnlySiblingsMayInhibitEachOther) {
  struct Case {
    std::vector<std::string> behaviours;
    std::string finding, message;
  };
  const std::vector<Case> cases{
      {{"M[A]", "A>B", "B"},
       "2:59 error not-a-sibling",
       "\"A\" cannot inhibit \"B\", for only behaviours in the same meta-behaviour can: the one is "
       "in \"M\", the other is in no meta-behaviour; "},
      {{"M[A]", "A", "B>A"}, "3:59 error not-a-sibling", "\"B\" cannot inhibit \"A\""},
      {{"M[A]", "N[B]", "A>B", "B"},
       "3:59 error not-a-sibling",
       "the one is in \"M\", the other is in \"N\""},
      {{"M[A]", "A>M"}, "2:59 error not-a-sibling", "\"A\" cannot inhibit \"M\""},
      {{"M[A]>A", "A"}, "1:59 error not-a-sibling", "\"M\" cannot inhibit \"A\""},
      {{"M[N B]", "N[A]", "A>B", "B"}, "3:59 error not-a-sibling", "\"A\" cannot inhibit \"B\""},
      {{"A>A"}, "1:59 error self-inhibition", "\"A\" inhibits itself; remove"},
      {{"M[A]>M", "A"}, "1:59 error self-inhibition", "\"M\" inhibits itself"},
  };
  for (const Case& c : cases) {
    const Loaded loaded = load_text(model(c.behaviours));
    EXPECT_THAT(loaded.findings(), ElementsAre(c.finding)) << model(c.behaviours);
    EXPECT_THAT(loaded.message(), HasSubstr(c.message));
  }
}

TEST(Hierarchy, NoListIsMadeOfALongText) {
  std::string many;
  for (int i = 0; i < 30'000; ++i) many += "B ";
  const Loaded loaded =
      load_text("<behaviors><behavior name='A'><config at='/p'>/a</config><inhibition>" + many +
                "</inhibition></behavior><behavior name='B'><config at='/p'>/b</config></behavior>"
                "</behaviors>");
  EXPECT_THAT(loaded.message(), Not(HasSubstr("separated by commas")));
}

TEST(Hierarchy, NamesMustBeKnownAndUnique) {
  struct Case {
    std::vector<std::string> behaviours;
    std::string finding, message;
  };
  const std::vector<Case> cases{
      {{"Alpha>Betta", "Beta"},
       "1:67 error unknown-name",
       "no behaviour has the name \"Betta\"; did you mean \"Beta\"?"},
      {{"A>B;C", "B", "C"},
       "1:59 error unknown-name",
       "no behaviour has the name \"B;C\"; names are separated by commas: write \"B, C\""},
      {{"A>B C", "B", "C"}, "1:59 error unknown-name", "by commas: write \"B, C\""},
      {{"A>B Zulu", "B"},
       "1:59 error unknown-name",
       "define it, correct the name, or give the file"},
      {{"A>b; B", "B"}, "1:59 error unknown-name", "\"b; B\"; names are separated by commas"},
      {{"A>*", "B"}, "1:59 error unknown-name", "\"*\"; each is named by itself, or all that are"},
      {{"A>all", "B"}, "1:59 error unknown-name", "\"all\"; each is named by itself"},
      {{"M[A Bee]", "A>Beta", "Beta"},
       "1:57 error unknown-name",
       "no behaviour has the name \"Bee\""},
      {{"A>Zulu"}, "1:59 error unknown-name", "define it, correct the name, or give the file"},
      {{"A>/B", "B"},
       "1:59 error unknown-name",
       "name \"/B\"; it is a source: name the behaviour that connects it, \"B\""},
      {{"M[Zulu A]", "A"}, "1:35 error unknown-name", "no behaviour has the name \"Zulu\""},
      {{"A", "B", "A"}, "3:17 error duplicate-name", "\"A\" is taken already, at "},
      {{"A", "M[B]", "B", "A[B]"}, "4:22 error duplicate-name", "rename or remove one"},
      {{"M[A B A]", "A", "B"},
       "1:79 error two-parents",
       "\"A\" is in this meta-behaviour already, at "},
      {{"M[A]", "N[A]", "A"}, "2:35 error two-parents", "\"A\" is in \"M\" already, at "},
      {{"M[M]"}, "1:35 error cycle", "\"M\" contains \"M\"; remove one of these"},
      {{"M[N]", "N[O]", "O[M]"},
       "1:35 error cycle",
       "\"M\" contains \"N\" contains \"O\" contains \"M\";"},
      {{"A", "Top[N]", "N[A M]", "M[O]>A", "O[M]"},
       "5:35 error two-parents",
       "\"M\" is in \"N\" already"},
  };
  for (const Case& c : cases) {
    const Loaded loaded = load_text(model(c.behaviours));
    EXPECT_THAT(loaded.findings(), ElementsAre(c.finding)) << model(c.behaviours);
    EXPECT_THAT(loaded.message(), HasSubstr(c.message));
  }
}

TEST(Hierarchy, OfANameThatLacksAWordTheWholeOneIsProposed) {
  const auto message = [](const std::string& inhibited) {
    return load_text("<behavior name='A'><config at='/p'>/a</config><inhibition>" + inhibited +
                     "</inhibition></behavior>"
                     "<behavior name='Look Around'><config at='/p'>/b</config></behavior>"
                     "<behavior name='Follow Face'><config at='/p'>/c</config></behavior>"
                     "<behavior name='Follow Wall'><config at='/p'>/d</config></behavior>")
        .message();
  };
  EXPECT_THAT(message("around"), HasSubstr("did you mean \"Look Around\"?"));
  EXPECT_THAT(message("Look"), HasSubstr("did you mean \"Look Around\"?"));
  EXPECT_THAT(message("Loo"), HasSubstr("; define it"));
  EXPECT_THAT(message("Follow"), HasSubstr("; define it"));
}

TEST(Hierarchy, ASecondPlaceIsNamedWithFileLineAndColumn) {
  const Folder folder;
  const std::string a = folder.write("a.xml", model({"A", "B"}));
  const std::string b = folder.write("b.xml", model({"C", "B"}));
  const Loaded loaded = load_files({{a, b}, {}});
  EXPECT_THAT(loaded.findings(true), ElementsAre("b.xml:2:17 error duplicate-name"));
  EXPECT_THAT(loaded.message(), HasSubstr("taken already, at " + a + ":2:17; "));
}

TEST(Hierarchy, EachCycleIsReportedOnce) {
  const Loaded loaded = load_text(
      model({"A", "M[N]>A", "N[M]", "O[P A]", "P[Q B]", "Q[P]", "B>Q", "R[S]", "S[C]", "C"}));
  EXPECT_THAT(loaded.findings(), ElementsAre("2:35 error cycle", "6:35 error two-parents"))
      << "P has two parents, and the first one counts";
}

TEST(Hierarchy, ALongCycleIsNotToldInFull) {
  std::vector<std::string> behaviours;
  for (int i = 0; i < 100; ++i) {
    behaviours.push_back("M" + std::to_string(i) + "[M" + std::to_string((i + 1) % 100) + "]");
  }
  const Loaded loaded = load_text(model(behaviours));
  EXPECT_THAT(loaded.findings(), ElementsAre("1:36 error cycle"));
  EXPECT_THAT(loaded.message(), HasSubstr("\"M0\" contains \"M1\" contains \"M2\""));
  EXPECT_THAT(loaded.message(), HasSubstr("contains … contains \"M0\""));
  EXPECT_LT(loaded.message().size(), 400u);
}

TEST(Hierarchy, EmptyOnesAreWarnedOf) {
  const Loaded loaded = load_text(
      "<behavior name='B'/>\n<meta_behavior name='M'><condition/></meta_behavior>\n"
      "<behavior name='C'><condition>/x</condition></behavior>");
  EXPECT_THAT(loaded.findings(), ElementsAre("1:17 warning no-config", "2:22 warning no-children",
                                             "3:17 warning no-config"));
  EXPECT_THAT(loaded.message(0), HasSubstr("\"B\" selects no connection; write a <config>"));
  EXPECT_THAT(loaded.message(1), HasSubstr("\"M\" contains nothing; name its behaviours"));
  EXPECT_THAT(load_text("<behavior name='B'><config at='/p'>/s</config></behavior>\n"
                        "<behavior name='Stop'><condition>/estop</condition>"
                        "<inhibition>B</inhibition></behavior>")
                  .message(),
              HasSubstr("selects no connection, so that it inhibits nothing; write a <config>"));
  EXPECT_THAT(load_text("<behavior name='B'><config at='/p'>s</config></behavior>").findings(),
              ElementsAre("1:36 error invalid-port-name"))
      << "it has a config, though a wrong one";
}

std::vector<std::string> nested(int depth) {
  std::vector<std::string> behaviours;
  for (int i = 0; i < depth; ++i) {
    behaviours.push_back("M" + std::to_string(i) + "[M" + std::to_string(i + 1) + "]");
  }
  behaviours.push_back("M" + std::to_string(depth));
  return behaviours;
}

TEST(Hierarchy, AThousandMetaBehavioursMayBeNested) {
  EXPECT_THAT(load_text(model(nested(kMaxMetaDepth))).findings(), IsEmpty());
  for (const int depth : {kMaxMetaDepth + 1, 50'000}) {
    const Loaded loaded = load_text(model(nested(depth)));
    EXPECT_THAT(loaded.findings(), ElementsAre("1001:39 error limit-exceeded"));
    EXPECT_THAT(loaded.message(),
                HasSubstr("\"M1001\" is inside more meta-behaviours than the limit of 1000"));
  }
}

}  // namespace
}  // namespace arbiter::rules
