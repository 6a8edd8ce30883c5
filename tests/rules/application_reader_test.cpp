#include "rules/model/application_reader.hpp"

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "tests/rules/model_text.hpp"

namespace arbiter::rules {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const std::string kModel = "<behavior name='B'><config at='/p'>/s</config></behavior>";

std::string connection(const std::string& from, const std::string& to) {
  return "<connection><from>" + from + "</from><to>" + to + "</to></connection>";
}

std::vector<std::string> show_others(const Loaded& loaded) {
  std::vector<std::string> result;
  for (const Connection& other : loaded.rules.other_connections) {
    result.push_back(other.source + " -> " + other.port);
  }
  return result;
}

TEST(Application, SaysWhichConnectionsExist) {
  const Loaded loaded = load_with_application(
      kModel, "<application>" + connection("/z", "/p") + connection("/s", "/p") +
                  connection("/s", "/q") + connection("/a", "/b") + "</application>");
  EXPECT_THAT(loaded.findings(), IsEmpty()) << loaded.message();
  EXPECT_THAT(show_others(loaded), ElementsAre("/z -> /p", "/s -> /q", "/a -> /b"));
  EXPECT_THAT(loaded.rules.sources, ElementsAre("/s")) << "the model names no others";
  EXPECT_THAT(show_rules(loaded, "/p"), ElementsAre("/s: true"));
}

TEST(Application, WarnsOfAMisspeltElement) {
  const Loaded loaded = load_with_application(
      kModel, "<application>" + connection("/s", "/p") +
                  "\n<conection><from>/a</from><to>/b</to></conection>"
                  "\n<modules><module><name>m</name></module></modules>"
                  "\n<Arbitration/>"
                  "\n<module><nmae>m</nmae><prefx>/m</prefx><nodes>head</nodes></module>"
                  "\n</application>");
  EXPECT_THAT(loaded.findings(),
              ElementsAre("2:1 warning misspelt-element", "3:1 warning misspelt-element",
                          "4:1 warning misspelt-element", "5:9 warning misspelt-element",
                          "5:23 warning misspelt-element", "5:40 warning misspelt-element"));
  EXPECT_THAT(loaded.message(), HasSubstr("did you mean <connection>?"));
  EXPECT_THAT(loaded.message(1), HasSubstr("each <module> stands in <application> itself: remove "
                                           "<modules> and its end, and leave what it holds"));
}

// It has no effect there.
TEST(Application, WarnsOfWhatBelongsIntoTheArbitration) {
  const Loaded loaded = load_with_application(
      kModel, "<application>" + connection("/s", "/p") +
                  "\n<source port='/s' timeout='10s'/>"
                  "\n<behaviors><behavior name='B'/></behaviors>\n</application>");
  EXPECT_THAT(loaded.findings(),
              ElementsAre("2:1 warning misspelt-element", "3:1 warning misspelt-element"));
  EXPECT_THAT(loaded.message(), HasSubstr("; put it into <arbitration>"));
  EXPECT_THAT(loaded.message(1), HasSubstr("; put what it holds into <arbitration>"));
}

// YARP's own, what a module has beside its own, and short words that differ in a letter.
TEST(Application, PassesOverWhatIsNoMisspeltElement) {
  const Loaded loaded = load_with_application(
      kModel, "<application><name>a</name><description/><authors/><arbitrator/>" +
                  connection("/s", "/p") +
                  "<module><name>m</name><note>n</note><names/><rank>1</rank><mode/></module>"
                  "</application>");
  EXPECT_THAT(loaded.findings(), IsEmpty()) << loaded.message();
}

TEST(Application, SaysWhichEndOfAConnectionIsMisspelt) {
  const Loaded loaded = load_with_application(
      kModel, "<application>" + connection("/s", "/p") +
                  "<connection><form>/a</form><to>/b</to></connection></application>");
  EXPECT_THAT(loaded.message(), HasSubstr("lacks <from>; did you mean it where it has <form>?"));
  const Loaded capital = load_with_application(
      kModel, "<application>" + connection("/s", "/p") +
                  "<connection><From>/a</From><TO>/b</TO></connection></application>");
  EXPECT_THAT(capital.message(0), HasSubstr("lacks <from>; did you mean it where it has <From>?"));
  EXPECT_THAT(capital.message(1), HasSubstr("lacks <to>; did you mean it where it has <TO>?"));
  const auto attribute =
      load_with_application(kModel, "<application>" + connection("/s", "/p") +
                                        "<connection from='/a' to='/b'/></application>");
  EXPECT_THAT(attribute.message(0),
              HasSubstr("lacks <from>; it is no attribute: write <from>…</from>"));
  EXPECT_THAT(attribute.message(1), HasSubstr("lacks <to>; it is no attribute: write <to>…</to>"));
}

TEST(Application, MayCallTheEndsOfAConnectionOutputAndInputAsYarpDoes) {
  const Loaded loaded = load_with_application(
      kModel,
      "<application><connection><output>/s</output><input>/p</input></connection>"
      "<connection><output>/no</output><from>/a</from><to>/b</to></connection></application>");
  EXPECT_THAT(loaded.findings(), IsEmpty()) << loaded.message();
  EXPECT_THAT(show_others(loaded), ElementsAre("/a -> /b"));
}

TEST(Application, PassesOverEverythingElse) {
  const Loaded loaded = load_with_application(kModel, R"(<?xml version="1.0" encoding="UTF-8" ?>
    <!DOCTYPE application><?xml-stylesheet type="text/xsl" href="yarpmanager.xsl"?>
    <application anything="goes" anything="twice"> stray &nbsp; text, Andr)"
                                                      "\xe9"
                                                      R"(
      <name>Search &amp; Track &unknown;</name>
      <dependencies><port timeout="5.0" request="time">/icub/head/state:o</port></dependencies>
      <module><name>a</name><parameters>--x ${HOME} &</parameters><node/><prefix/>
        <connection><from>/inside/a/module</from></connection></module>
      <application><name>other</name></application>
      <connection id="1" persist="true"> text
        <!-- c --><from external="true" carrier="tcp"> /s
        </from>
        <from>/only/the/first</from><to><![CDATA[/p]]></to>
        <protocol>fast_tcp+send.portmonitor</protocol><qos><level>low</level></qos>
        <geometry>(Pos ((x 1) (y 2)))</geometry>
      </connection>
      <connection><from>topic://map</from><to>/a&amp;b</to></connection>
      <arbiter><port>/p</port><rule connection="1">~2</rule></arbiter>
      <Dependency/><node>x</node>
    </application>)");
  EXPECT_THAT(loaded.findings(), IsEmpty()) << loaded.message();
  EXPECT_THAT(show_others(loaded), ElementsAre("topic://map -> /a&b"));
}

TEST(Application, MayBeWithoutConnections) {
  for (const std::string application :
       {"<application/>", "<application><name>x</name></application>\n<!-- c -->"}) {
    const Loaded loaded = load_with_application("<behaviors/>", application);
    EXPECT_THAT(loaded.findings(), IsEmpty());
    EXPECT_THAT(show_others(loaded), IsEmpty());
  }
}

TEST(Application, WithoutAModelHasConnectionsAndNoRules) {
  const Folder folder;
  const Loaded loaded = load_files(
      {{}, folder.write("app.xml", "<application>" + connection("/s", "/p") + "</application>")});
  EXPECT_THAT(loaded.findings(), IsEmpty());
  EXPECT_THAT(show_others(loaded), ElementsAre("/s -> /p"));
}

TEST(Application, ThatLacksAConfiguredConnectionIsAnErrorOfTheModel) {
  const Loaded loaded = load_with_application(
      "<behavior name='B'>\n<config at='/p'>/s</config>\n<config at='/q'>/s</config></behavior>\n"
      "<behavior name='C'><config at='/q'>/s</config></behavior>\n"
      "<arbiter at='/p'><select from='/t'>/sensed</select></arbiter>",
      "<application>" + connection("/s", "/p") + connection("/q", "/s") + "</application>");
  EXPECT_THAT(loaded.findings(true), ElementsAre("a.xml:3:1 error not-in-application",
                                                 "a.xml:5:18 error not-in-application"));
  EXPECT_THAT(loaded.message(0),
              HasSubstr("the application has no connection from /s to /q; exchange"));
  EXPECT_THAT(loaded.message(1), HasSubstr("from /t to /p"));
}

TEST(Application, ThatHasAConnectionOfNearlyThatNameIsAskedAbout) {
  const auto message = [](const std::string& source, const std::string& port) {
    return load_with_application(
               "<behavior name='B'><config at='" + port + "'>" + source + "</config></behavior>",
               "<application>" + connection("/Rest/pos:o", "/Arm/pos:i") +
                   connection("Face/pos:o", "/Gaze/pos:i") + connection("/Face/pos:o", "Face:i") +
                   connection("/Hand/pos:i", "/Grasp/pos:o") + "</application>")
        .message();
  };
  const std::string advice = "; add it there, or correct the names here";
  EXPECT_THAT(message("/Rset/pos:o", "/Arm/pos:i"),
              HasSubstr(advice + ": did you mean \"/Rest/pos:o\"?"));
  EXPECT_THAT(message("/Rest/pos:o", "/Arm/po:i"),
              HasSubstr(advice + ": did you mean \"/Arm/pos:i\"?"));
  EXPECT_THAT(message("/Rest/pos:o", "/Gaze/pos:i"), testing::EndsWith(advice));
  EXPECT_THAT(message("/Face/pos:o", "/Gaze/pos:i"),
              HasSubstr("; put a slash in front of \"Face/pos:o\" there"));
  EXPECT_THAT(message("/Face/pos:o", "/Face:i"),
              HasSubstr("; put a slash in front of \"Face:i\" there"));
  EXPECT_THAT(message("/Grasp/pos:o", "/Hand/pos:i"),
              HasSubstr("; exchange the two ends of that from /Hand/pos:i to /Grasp/pos:o there"));
}

TEST(Application, MistakesAreReportedAtTheirPlace) {
  struct Case {
    std::string application, finding, message;
  };
  const std::vector<Case> cases{
      {"", "app.xml:1:1 error empty-file", "is <application/>"},
      {" <!-- c --> ", "app.xml:1:1 error empty-file", "is <application/>"},
      {"t_ns,source", "app.xml:1:1 error not-an-application", "the file has no element"},
      {"<behaviors/>", "app.xml:1:1 error not-an-application",
       "is <application>, not <behaviors>; give a model as a model"},
      {"<application>\n<name>\n</application>", "app.xml:3:1 error malformed-xml",
       "does not fit <name>"},
      {"<application>\n<connection><from>/s</from></connection></application>",
       "app.xml:2:1 error incomplete-connection", "this connection lacks <to>"},
      {"<application>\n<connection><to>/p</to></connection></application>",
       "app.xml:2:1 error incomplete-connection", "this connection lacks <from>"},
      {"<application>\n<connection><from> </from><to>/p</to></connection></application>",
       "app.xml:2:19 error incomplete-connection", "<from> is empty; write the name"},
      {"<application>\n" + connection("/s&x", "/p") + "</application>",
       "app.xml:2:21 error malformed-xml", "write &amp;"},
      {"<application>\n" + connection("/s\n/t", "/p") + "</application>",
       "app.xml:2:19 error invalid-port-name", "line ends"},
      {"<application>\n" + connection("/s", "/" + std::string(255, 'p')) + "</application>",
       "app.xml:2:32 error name-too-long", "more than the limit of 255"},
      {"<application>\n" + connection("/s", "/p") + "\n" + connection(" /s", "/p ") +
           "</application>",
       "app.xml:3:1 note duplicate-connection", "from /s to /p exists already, at "},
      {std::string("<application>\n\0</application>", 29), "app.xml:2:1 error invalid-character",
       "NUL"},
  };
  for (const Case& c : cases) {
    const Loaded loaded = load_with_application(kModel, c.application);
    EXPECT_THAT(loaded.findings(true), ElementsAre(c.finding)) << c.application;
    EXPECT_THAT(loaded.message(), HasSubstr(c.message)) << c.application;
  }
}

}  // namespace
}  // namespace arbiter::rules
