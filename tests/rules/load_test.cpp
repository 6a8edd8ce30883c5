#include "rules/model/load.hpp"

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "rules/prove/compile.hpp"
#include "rules/text/text_file.hpp"
#include "shm/limits.hpp"
#include "tests/rules/model_text.hpp"

namespace arbiter::rules {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

TEST(Load, SeveralFilesFormOneModel) {
  const Loaded loaded = load_texts({
      "<behaviors timeout='1s'><meta_behavior name='M'><behavior>B</behavior></meta_behavior>"
      "<behavior name='A'><config at='/p'>/a</config><inhibition>M</inhibition></behavior>"
      "</behaviors>",
      "<behavior name='B'><config at='/p'>/b</config></behavior>",
      "<behaviors timeout='1000ms'><source port='/a' timeout='2s'/></behaviors>",
  });
  EXPECT_THAT(loaded.findings(), IsEmpty()) << loaded.message();
  EXPECT_THAT(show_rules(loaded, "/p"), ElementsAre("/a: true", "/b: not(/a)"));
  EXPECT_EQ(loaded.rules.timeout, 1'000'000'000);
  EXPECT_THAT(loaded.rules.timeouts, SizeIs(1));
}

// As `diff` takes them.
TEST(Load, FilesInOneWordAreToBeGivenOneByOne) {
  const Folder folder;
  const std::string a = folder.write("a.xml", "<behaviors/>");
  const std::string b = folder.write("b.xml", "<behaviors/>");
  const auto problem_of = [](const std::string& path) -> std::string {
    try {
      (void)read_texts({{path}, {}});
    } catch (const FileError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(problem_of(a + "," + b), "cannot open " + a + "," + b +
                                         ": No such file or directory; " + a + " and " + b +
                                         " are files: give each of them by itself");
  for (const std::string& other : {a + ",", a + "," + b + "x", a + "x"}) {
    EXPECT_EQ(problem_of(other), "cannot open " + other + ": No such file or directory");
  }
  EXPECT_EQ(problem_of(folder.write("c,d.xml", "<behaviors/>")), "");
}

TEST(Load, WhatSeveralFilesSayTwiceIsAnErrorThatNamesTheOtherPlace) {
  struct Case {
    std::string first, second, finding, other_place;
  };
  const std::vector<Case> cases{
      {"<define name='d'/>", "\n<define name='d'/>", "b.xml:2:15 error duplicate-define", ":1:15"},
      {"<source port='/a'/>", "\n<source port='/a'/>", "b.xml:2:1 error duplicate-source", ":1:1"},
      {"<behavior name='B'><config at='/p'>/s</config></behavior>",
       "<behavior name='B'><config at='/p'>/s</config></behavior>",
       "b.xml:1:17 error duplicate-name", ":1:17"},
      {"<arbiter at='/p'><select from='/s'/></arbiter>",
       "\n<arbiter at='/p'><select from='/s'/></arbiter>", "b.xml:2:18 error duplicate-select",
       ":1:18"},
      {"<behaviors timeout='1s'/>", "<behaviors timeout='2s'/>",
       "b.xml:1:21 error conflicting-timeout", ":1:21"},
  };
  for (const Case& c : cases) {
    const Loaded loaded = load_texts({c.first, c.second});
    EXPECT_THAT(loaded.findings(true), ElementsAre(c.finding)) << c.second;
    EXPECT_THAT(loaded.message(), AllOf(HasSubstr("a.xml" + c.other_place), HasSubstr("; ")));
  }
}

TEST(Load, ReportsInTheOrderOfFilesLinesAndColumns) {
  const Folder folder;
  const std::string late = folder.write("z.xml", "<source port='a'/>\n<x/> y");
  const std::string early = folder.write("a.xml",
                                         "<behavior name='B'><inhibition>C, D</inhibition>"
                                         "</behavior>\n<source port='b'/>");
  const std::string application = folder.write("0.xml", "<application><connection/></application>");
  const Loaded loaded = load_files({{late, early}, application});
  EXPECT_THAT(
      loaded.findings(true),
      ElementsAre("z.xml:1:15 error invalid-port-name", "z.xml:2:1 error unknown-element",
                  "z.xml:2:6 error stray-text", "a.xml:1:17 warning no-config",
                  "a.xml:2:15 error invalid-port-name", "0.xml:1:14 error incomplete-connection",
                  "0.xml:1:14 error incomplete-connection"))
      << "C and D may be what <x> was meant to be";
}

TEST(Load, AddsToWhatTheDiagnosticsHoldAlready) {
  const Folder folder;
  Diagnostics diagnostics;
  diagnostics.note("before", {"z", 9, 9}, "m");
  load({{folder.write("a.xml", "")}, {}}, diagnostics);
  ASSERT_EQ(diagnostics.items().size(), 2u);
  EXPECT_EQ(diagnostics.items()[0].code, "before");
}

TEST(Load, AFileGivenTwiceIsAnError) {
  const Folder folder;
  const std::string path = folder.write("a.xml", "<behavior name='B'/>");
  const Loaded loaded = load_files({{path, path}, {}});
  EXPECT_THAT(loaded.findings(), ElementsAre("1:1 error duplicate-file", "1:17 warning no-config"));
  EXPECT_THAT(loaded.message(), HasSubstr("given twice; give it once"));
}

TEST(Load, AFileThatCannotBeReadIsThrown) {
  const Folder folder;
  const std::string good = folder.write("a.xml", "<behaviors/>");
  EXPECT_THROW(load_files({{folder.file("none.xml")}, {}}), FileError);
  EXPECT_THROW(load_files({{good, folder.file("")}, {}}), FileError);
  EXPECT_THROW(load_files({{good}, folder.file("none.xml")}), FileError);
  try {
    load_files({{folder.file("one.xml"), good, folder.file("two.xml")}, folder.file("app.xml")});
    FAIL();
  } catch (const FileError& error) {
    for (const char* name : {"one.xml", "two.xml", "app.xml"}) {
      EXPECT_THAT(error.what(), testing::HasSubstr("cannot open " + folder.file(name) + ": No"));
    }
  }
}

TEST(Load, AFileBeyondTheLimitIsRefused) {
  const std::string blanks(kMaxFileBytes, ' ');
  EXPECT_THAT(load_text("<behaviors>" + blanks.substr(23) + "</behaviors>").findings(), IsEmpty());
  const Loaded loaded = load_text("<behaviors>" + blanks.substr(22) + "</behaviors>");
  EXPECT_THAT(loaded.findings(), ElementsAre("1:1 error limit-exceeded"));
  EXPECT_THAT(loaded.message(), HasSubstr("the limit of 16 MiB"));
  EXPECT_THAT(load_with_application("<behaviors/>", blanks + " ").findings(true),
              ElementsAre("app.xml:1:1 error limit-exceeded"));
}

TEST(Load, KeepsNoMoreOfACodeThanCanBeReadAndCountsTheRest) {
  std::string model;
  for (int i = 0; i < 20'000; ++i) model += "<x/>\n";
  Diagnostics diagnostics;
  load_all({{{"a.xml", model}}, {}}, diagnostics);
  ASSERT_EQ(diagnostics.items().size(), Diagnostics::kMaxOfCode);
  EXPECT_EQ(diagnostics.items().back().where.line, 10'000u);
  EXPECT_EQ(diagnostics.count(Severity::kError), 20'000u);
  ASSERT_EQ(diagnostics.omissions().size(), 1u);
  EXPECT_EQ(diagnostics.omissions()[0].code, "unknown-element");
  EXPECT_EQ(diagnostics.omissions()[0].count, 10'000u);
  EXPECT_EQ(diagnostics.omissions()[0].where.line, 10'000u);
}

// `Stop i` at a port of its own inhibits a meta-behaviour of all `Bi`: a note for each pair.
std::string inhibitions_across_ports(unsigned stops) {
  std::string model = "<behaviors>\n<meta_behavior name='All'>";
  for (unsigned i = 0; i < stops; ++i) model += "<behavior>B" + std::to_string(i) + "</behavior>";
  model += "</meta_behavior>\n";
  for (unsigned i = 0; i < stops; ++i) {
    const std::string n = std::to_string(i);
    model += "<behavior name='Stop " + n + "'><config at='/stop" + n + ":i'>/stop" + n +
             ":o</config><inhibition>All</inhibition></behavior>\n<behavior name='B" + n +
             "'><config at='/p" + n + ":i'>/s" + n + ":o</config></behavior>\n";
  }
  return model + "</behaviors>";
}

TEST(Load, IsNotRefusedForNotesHoweverMany) {
  Diagnostics diagnostics;
  load_all({{{"a.xml", inhibitions_across_ports(101)}}, {}}, diagnostics);
  EXPECT_FALSE(diagnostics.has_errors());
  EXPECT_EQ(diagnostics.count(Severity::kNote, "inhibition-across-ports"), 101u * 101u);
  EXPECT_EQ(diagnostics.items().size(), Diagnostics::kMaxOfCode);
}

TEST(Load, ShowsAnErrorBehindAnyNumberOfNotes) {
  std::string model = inhibitions_across_ports(101);
  model.insert(model.rfind("</behaviors>"),
               "<behavior name='A'><config at='/x:i'>/a:o</config></behavior>\n"
               "<behavior name='B'><config at='/x:i'>/b:o</config></behavior>\n");
  Diagnostics diagnostics;
  compile(load_all({{{"a.xml", model}}, {}}, diagnostics).rules, diagnostics);
  EXPECT_TRUE(diagnostics.has_errors());
  EXPECT_EQ(diagnostics.items().back().code, "both-can-win");
}

// A model with so many connections, from so many sources, to so many ports.
std::string grid(unsigned sources, unsigned ports, const std::string& condition = "") {
  std::string model = "<behaviors>\n";
  for (unsigned p = 0; p < ports; ++p) {
    model += "<arbiter at='/p" + std::to_string(p) + "'>";
    for (unsigned s = 0; s < sources; ++s) {
      model += "<select from='/s" + std::to_string(s) + "'>" + condition + "</select>";
    }
    model += "</arbiter>\n";
  }
  return model + "</behaviors>";
}

std::string application(unsigned sources, unsigned ports) {
  std::string result = "<application>\n";
  for (unsigned p = 0; p < ports; ++p) {
    for (unsigned s = 0; s < sources; ++s) {
      result += "<connection><from>/s" + std::to_string(s) + "</from><to>/p" + std::to_string(p) +
                "</to></connection>\n";
    }
  }
  return result + "</application>";
}

TEST(Load, HoldsToTheLimitOfSourcesAtOnePort) {
  EXPECT_THAT(load_text(grid(shm::kMaxSourcesPerPort, 1)).findings(), IsEmpty());
  const Loaded connected = load_text(grid(shm::kMaxSourcesPerPort + 1, 1));
  EXPECT_THAT(connected.findings(), ElementsAre("2:1 error limit-exceeded"));
  EXPECT_THAT(connected.message(), HasSubstr("there are 257 sources at /p0, connected or read by "
                                             "its rules, more than the limit of 256; "));

  // Connected ones and read ones count together, each once, quantifiers expanded.
  std::string sources;
  for (int i = 0; i < 255; ++i) sources += "<source port='/read/" + std::to_string(i) + "'/>";
  const std::string reads = "any(/read/*)";
  EXPECT_THAT(load_texts({grid(1, 1, reads), sources}).findings(), IsEmpty());
  EXPECT_THAT(load_texts({grid(2, 1, reads), sources}).findings(),
              ElementsAre("2:1 error limit-exceeded"));
  EXPECT_THAT(load_texts({grid(1, 1, reads + " and /s0"), sources}).findings(), IsEmpty());
  EXPECT_THAT(load_texts({grid(1, 1, reads + " and /t"), sources}).findings(),
              ElementsAre("2:1 error limit-exceeded"));

  EXPECT_THAT(load_with_application(grid(1, 1), application(256, 1)).findings(), IsEmpty());
  EXPECT_THAT(load_with_application(grid(1, 1, "/t"), application(256, 1)).findings(true),
              ElementsAre("a.xml:2:1 error limit-exceeded"));
  EXPECT_THAT(load_with_application("<behaviors/>", application(257, 1)).findings(true),
              ElementsAre("app.xml:2:1 error limit-exceeded"));
}

TEST(Load, HoldsToTheLimitOfDestinationsOfOneOutputPort) {
  EXPECT_THAT(load_text(grid(1, shm::kMaxDestinations)).findings(), IsEmpty());
  const Loaded loaded = load_text(grid(1, shm::kMaxDestinations + 1));
  EXPECT_THAT(loaded.findings(), ElementsAre("66:20 error limit-exceeded"))
      << "at the first connection that is one too many";
  EXPECT_THAT(loaded.message(), HasSubstr("there are 65 destinations of /s0, more than the limit "
                                          "of 64; connect it to fewer"));
  EXPECT_THAT(load_with_application("<behaviors/>", application(1, 65)).findings(true),
              ElementsAre("app.xml:66:1 error limit-exceeded"));
}

TEST(Load, HoldsToTheLimitOfConnections) {
  EXPECT_THAT(load_text(grid(64, 64)).findings(), IsEmpty());
  const Loaded loaded =
      load_texts({grid(64, 64), "<arbiter at='/q'><select from='/t'/></arbiter>"});
  EXPECT_THAT(loaded.findings(true), ElementsAre("b.xml:1:18 error limit-exceeded"));
  EXPECT_THAT(loaded.message(),
              HasSubstr("there are 4097 connections, more than the limit of 4096"));
}

TEST(Load, HoldsToTheLimitOfSourcesAndInputPorts) {
  std::string sources = "<behaviors>";
  for (unsigned i = 0; i < shm::kMaxSources; ++i) {
    sources += "<source port='/" + std::to_string(i) + "'/>";
  }
  EXPECT_FALSE(load_text(sources + "</behaviors>").has_errors);
  const Loaded loaded = load_with_application(
      sources + "</behaviors>",
      "<application><connection><from>/x</from><to>/y</to></connection></application>");
  EXPECT_THAT(loaded.findings(true), ElementsAre("a.xml:1:1 error limit-exceeded"));
  EXPECT_THAT(loaded.message(), HasSubstr("there are 8193 sources, more than the limit of 8192"));

  std::string ports = "<behaviors>";
  for (unsigned i = 0; i <= shm::kMaxInputPorts; ++i) {
    const std::string n = std::to_string(i);
    ports += "<arbiter at='/p" + n + "'><select from='/s" + n + "'/></arbiter>";
  }
  const Loaded wide = load_text(ports + "</behaviors>");
  EXPECT_EQ(wide.items.size(), 2u) << "connections as well as ports";
  EXPECT_THAT(wide.message(0), HasSubstr("4097 input ports, more than the limit of 4096"));
}

// Modules as YARP writes them; the connections are those of the model.
std::vector<std::string> published_by(const std::string& modules, const std::string& sensed) {
  const auto loaded = load_with_application(
      "<behavior name='A'><config at='/p'>/a</config><condition>not " + sensed +
          "</condition></behavior>",
      "<application>" + modules + "<connection><from>/a</from><to>/p</to></connection>" +
          "<connection><from>/x</from><to>/unrelated</to></connection></application>");
  return loaded.findings(true);
}

TEST(Load, ASourceThatIsSensedMustBelongToAModuleOrAConnection) {
  const std::string modules =
      "<module><name>laser</name><prefix>/front</prefix></module>"
      "<module><name>bumper</name><parameters>--rate 5 --name /hull --x 1</parameters></module>";
  for (const auto* fine : {"/x", "/a", "/front/scan:o", "/front:o", "/front", "/laser/scan:o",
                           "/bumper:o", "/hull/hit:o"}) {
    EXPECT_THAT(published_by(modules, fine), IsEmpty()) << fine;
  }
  for (const auto* lost : {"/fronts:o", "/rear/scan:o", "/rate", "/hul"}) {
    EXPECT_THAT(published_by(modules, lost), ElementsAre("a.xml:1:47 warning never-published"))
        << lost;
  }
}

// That the application lacks its connection is an error of its own.
TEST(Load, ASourceThatTheModelConnectsIsNotReportedAsUnpublished) {
  const Loaded loaded = load_with_application(
      "<behavior name='A'><config at='/p'>/a</config></behavior>"
      "<behavior name='B'><config at='/p'>/b</config><inhibition>A</inhibition></behavior>",
      "<application><module><name>m</name></module>"
      "<connection><from>/a</from><to>/p</to></connection></application>");
  EXPECT_THAT(loaded.findings(true), ElementsAre("a.xml:1:77 error not-in-application"));
}

// Two programs command one motor, and nothing decides between them.
TEST(Load, SeveralSourcesAtAPortWithoutRulesAreNoted) {
  const auto load = [](const std::string& connection) {
    return load_with_application("<behavior name='A'><config at='/p'>/a</config></behavior>",
                                 "<application><connection><from>/a</from><to>/p</to></connection>"
                                 "<connection><from>/b</from><to>/motor</to></connection>" +
                                     connection + "</application>");
  };
  EXPECT_THAT(load("").findings(), IsEmpty());
  const auto noted = load("<connection><from>/c</from><to>/motor</to></connection>");
  EXPECT_THAT(noted.findings(), ElementsAre("1:120 note not-arbitrated"));
  EXPECT_THAT(noted.message(), HasSubstr("/b and /c are connected to /motor, and no rule decides"));
  EXPECT_THAT(load("<connection><from>/c</from><to>/p</to></connection>").findings(), IsEmpty());
}

TEST(Load, ASourceThatNobodyPublishesIsShownWhereItIsReadWithTheNameThatWasMeant) {
  const auto load = [](const std::string& condition) {
    return load_with_application(
        "<behavior name='A'>\n<config at='/p'>/a</config>\n<condition>not " + condition +
            "</condition>\n</behavior>",
        "<application><module><prefix>/collision</prefix></module>"
        "<connection><from>/a</from><to>/p</to></connection>"
        "<connection><from>/Front/scan:o</from><to>/unrelated</to></connection></application>");
  };
  const auto connected = load("/Font/scan:o");
  EXPECT_THAT(connected.findings(true),
              ElementsAre("a.xml:3:1 warning never-published", "a.xml:3:16 warning similar-name"));
  EXPECT_THAT(connected.message(), HasSubstr("never be active; did you mean \"/Front/scan:o\"?"));
  const auto of_module = load("/colision/state:o");
  EXPECT_THAT(of_module.message(), HasSubstr("; did you mean \"/collision/state:o\"?"));
  EXPECT_THAT(load("/bumper:o").message(), HasSubstr("; correct the name, or add the module"));
}

TEST(Load, WithoutModulesAnApplicationDoesNotTellWhoPublishes) {
  EXPECT_THAT(published_by("", "/anything"), IsEmpty());
}

}  // namespace
}  // namespace arbiter::rules
