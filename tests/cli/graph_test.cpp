#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/cli/arbiter_program.hpp"
#include "tests/support/temporary_directory.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

// Whatever a name or a file may be called.
const std::string kNasty = R"(<behaviors>
  <meta_behavior name="&quot;A&quot; &lt;B&gt; &amp;amp; \N"><behavior>größer</behavior></meta_behavior>
  <behavior name="größer">
    <config at="/p&lt;&amp;&gt;\">/a'{|}</config>
    <condition>not "/ö&amp;" and not /c</condition>
  </behavior>
</behaviors>
)";

TEST(Graph, IsTheSameEachTime) {
  const TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kOverrideModel);
  const auto result = arbiter({"graph", model, "--format", "dot"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, HasSubstr("<B>Low</B>"));
  EXPECT_THAT(result.out, HasSubstr("b1 -> b0 "));
  EXPECT_THAT(result.out, HasSubstr("High inhibits Low, " + model + ":3"));
  EXPECT_EQ(arbiter({"graph", model, "--format", "dot"}).out, result.out);
}

TEST(Graph, ShowsConnectionsWhereThereAreNoBehaviours) {
  const TemporaryDirectory directory;
  const auto model = directory.write("m.xml", R"(<arbiter at="/P/in:i">
    <select from="/A/out:o">not /S/on:o</select></arbiter>)");
  const auto result = arbiter({"graph", model, "--format", "dot"});
  EXPECT_THAT(result.out, HasSubstr("/A/out:o ∧ ¬/S/on:o"));
  EXPECT_THAT(result.out, HasSubstr("/S/on:o is sensed at /P/in:i"));
}

TEST(Graph, DrawsWhateverNamesThereAre) {
  const TemporaryDirectory directory;
  const auto model = directory.write("m \"1\"\n.xml", kNasty);
  for (const char* view : {"behaviours", "connections", "both"}) {
    const auto result = arbiter({"graph", model, "--view", view});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "");
    EXPECT_THAT(result.out, HasSubstr("</svg>"));
    if (std::string(view) == "connections") continue;
    EXPECT_THAT(result.out, HasSubstr("&quot;A&quot; &lt;B&gt; &amp;amp; \\N"));
    EXPECT_THAT(result.out, HasSubstr("größer"));
    EXPECT_THAT(result.out, HasSubstr("¬&quot;/ö&amp;&quot;"));
  }
}

TEST(Graph, ChoosesTheFormatByTheNameOfTheFile) {
  const TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kOverrideModel);
  const auto drawn = [&](const std::string& name, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{"graph", model, "-o", directory.path() + "/" + name};
    arguments.insert(arguments.end(), more.begin(), more.end());
    EXPECT_EQ(arbiter(arguments).exit_code, 0);
    return content_of(directory.path() + "/" + name);
  };
  EXPECT_THAT(drawn("a.svg"), StartsWith("<?xml"));
  EXPECT_THAT(drawn("a.png"), StartsWith("\x89PNG"));
  EXPECT_THAT(drawn("a.dot"), StartsWith("digraph"));
  EXPECT_THAT(drawn("a.gv"), StartsWith("digraph"));
  EXPECT_THAT(drawn("a"), StartsWith("<?xml"));
  EXPECT_THAT(drawn("b.svg", {"--format", "png"}), StartsWith("\x89PNG"));
  EXPECT_THAT(drawn("B.PNG"), StartsWith("\x89PNG"));
  EXPECT_THAT(drawn("a.pdf"), StartsWith("%PDF"));
  EXPECT_THAT(drawn("a.txt", {"--format", "dot"}), StartsWith("digraph"));
  const std::string other = directory.path() + "/a.svg.bak";
  const auto result = arbiter({"graph", model, "-o", other});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("no picture is made of the ending of " + other));
  EXPECT_FALSE(std::filesystem::exists(other));
}

TEST(Graph, SaysWhatToInstallWhereGraphvizIsMissing) {
  const TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kOverrideModel);
  const std::string program = ARBITER_PROGRAMS "/arbiter";
  const std::vector<std::string> without{"/usr/bin/env", "PATH=" + directory.path(), program,
                                         "graph", model};
  const auto result = run_program(without);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("apt install graphviz"));
  auto as_dot = without;
  as_dot.insert(as_dot.end(), {"--format", "dot"});
  EXPECT_EQ(run_program(as_dot).exit_code, 0);
}

TEST(Graph, DrawsNothingOfAModelWithErrors) {
  const TemporaryDirectory directory;
  const auto result = arbiter({"graph", directory.write("m.xml", "<behaviors>")});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, HasSubstr("error: "));
}

const std::string kTwoHosts = R"(<application>
  <module><name>Low</name><parameters>--name /low</parameters><node>base</node></module>
  <module><name>Ports</name><parameters>--name /p</parameters><node>base</node></module>
  <module><name>High</name><parameters>--name /high</parameters><node>head</node></module>
</application>)";

TEST(Graph, DrawsBoxesOfTheHostsThatAnApplicationNames) {
  const TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kOverrideModel);
  const auto hosts = directory.write("hosts.xml", kTwoHosts);
  const auto result = arbiter({"graph", model, "--hosts", hosts, "--format", "dot"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("tooltip=\"host base\""));
  EXPECT_THAT(result.out, HasSubstr("tooltip=\"host head\""));
  EXPECT_EQ(arbiter({"graph", "--live", "--hosts", hosts}).exit_code, 2);
}

TEST(Graph, SaysWhatIsOnNoHostAndDrawsItAllTheSame) {
  const TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kOverrideModel);
  const auto hosts = directory.write("hosts.xml", R"(<application>
    <module><name>Low</name><parameters>--name /low</parameters><node>base</node></module>
    </application>)");
  const auto result = arbiter({"graph", model, "--hosts", hosts, "--format", "dot"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, HasSubstr("tooltip=\"host base\""));
  EXPECT_THAT(result.err, HasSubstr("[no-host]"));
}

// To see why is what one looks at them for.
TEST(Graph, DrawsRulesThatContradictEachOtherAndSaysSo) {
  const TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kConflictModel);
  const auto result = arbiter({"graph", model, "--format", "dot"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, StartsWith("digraph"));
  EXPECT_THAT(result.err, HasSubstr("[both-can-win]"));
}

TEST(Graph, SaysThatThereAreNoBehavioursToDraw) {
  const TemporaryDirectory directory;
  const auto rules =
      directory.write("r.xml", R"(<arbiter at="/in"><select from="/out"/></arbiter>)");
  const auto behaviours = directory.write("m.xml", kOverrideModel);
  const auto said_of = [](const std::string& model, const std::string& view) {
    return arbiter({"graph", model, "--view", view, "--format", "dot"}).err;
  };
  EXPECT_THAT(said_of(rules, "behaviours"), HasSubstr("no behaviours"));
  EXPECT_EQ(said_of(rules, "connections"), "");
  EXPECT_EQ(said_of(behaviours, "behaviours"), "");
}

TEST(Graph, HasATitleThatSaysWhatItIsOf) {
  const TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kOverrideModel);
  const auto dot = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"graph", model, "--format", "dot"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arbiter(arguments).out;
  };
  EXPECT_THAT(dot({}), HasSubstr("<B>m</B> · behaviours"));
  EXPECT_THAT(dot({}), HasSubstr(model));
  EXPECT_THAT(dot({"--view", "connections"}), HasSubstr("<B>m</B> · connections"));
  std::filesystem::create_directory(directory.path() + "/robot");
  const auto nameless = directory.write("robot/model.xml", kOverrideModel);
  EXPECT_THAT(arbiter({"graph", nameless, "--format", "dot"}).out,
              HasSubstr("<B>robot</B> · behaviours"));
}

TEST(Graph, DrawsOnlyWhatDecidesAtAPort) {
  const TemporaryDirectory directory;
  const auto model = directory.write("m.xml", R"(<behaviors>
    <behavior name="One"><config at="/p">/one</config></behavior>
    <behavior name="Two"><config at="/q">/two</config></behavior>
    <behavior name="Three"><config at="/r">/three</config></behavior></behaviors>)");
  const auto one = arbiter({"graph", model, "--format", "dot", "--port", "/p"});
  EXPECT_EQ(one.exit_code, 0);
  EXPECT_THAT(one.out, HasSubstr("only what decides at /p"));
  EXPECT_THAT(one.out, HasSubstr("One"));
  EXPECT_THAT(one.out, Not(HasSubstr("Two")));
  const auto two = arbiter({"graph", "--port", "/p", "--port", "/q", model, "--format", "dot"});
  EXPECT_THAT(two.out, HasSubstr("Two"));
  EXPECT_THAT(two.out, Not(HasSubstr("Three")));
  const auto both =
      arbiter({"graph", "--port", "/p", "--port", "/[pq]*", model, "--format", "dot"});
  EXPECT_EQ(both.exit_code, 1) << "only * is special";
  const auto some = arbiter({"graph", "--port", "/r", "--port", "*/r", model, "--format", "dot"});
  EXPECT_EQ(some.exit_code, 0);
  EXPECT_THAT(some.out, HasSubstr("Three"));
  EXPECT_THAT(some.out, Not(HasSubstr("One")));
  EXPECT_THAT(arbiter({"graph", "--port", "*", model, "--format", "dot"}).out, HasSubstr("One"));
  const auto no_match = arbiter({"graph", model, "--format", "dot", "--port", "/arm/*"});
  EXPECT_EQ(no_match.exit_code, 1);
  EXPECT_THAT(no_match.err, HasSubstr("no input port of the model matches --port '/arm/*'; "));
  const auto none = arbiter({"graph", model, "--format", "dot", "--port", "/s"});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_THAT(none.err, HasSubstr("no input port /s"));
  const auto source = arbiter({"graph", model, "--format", "dot", "--port", "/three"});
  EXPECT_EQ(source.exit_code, 1);
  EXPECT_THAT(source.err, HasSubstr("/three is an output port, connected to /r; give the input "
                                    "port first: --port /r"));
  EXPECT_THAT(arbiter({"graph", model, "--port", "/threee"}).err,
              HasSubstr("no input port /threee; did you mean the output port \"/three\", "));
  const auto bare = arbiter({"graph", model, "--port", "p"});
  EXPECT_EQ(bare.exit_code, 2);
  EXPECT_THAT(bare.err, HasSubstr("write \"/p\" for \"p\""));
}

// Bytes 16 to 23 of a PNG are its width and height.
unsigned width_of(const std::string& png) {
  unsigned width = 0;
  for (std::size_t i = 16; i < 20; ++i) width = width << 8 | static_cast<unsigned char>(png.at(i));
  return width;
}

TEST(Graph, HasAsManyDotsPerInchAsIsSaid) {
  const TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kOverrideModel);
  const auto width = [&](const std::string& dpi) {
    return width_of(arbiter({"graph", model, "--format", "png", "--dpi", dpi}).out);
  };
  EXPECT_NEAR(width("288"), 3 * width("96"), 4);
  EXPECT_THAT(arbiter({"graph", model, "--format", "dot", "--dpi", "288"}).out,
              HasSubstr("dpi=288"));
}

TEST(Graph, RefusesDotsThatNoPictureHas) {
  const TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kOverrideModel);
  for (const char* dpi : {"19", "1201", "-5", "x", "1e3", "96.5"}) {
    const auto result = arbiter({"graph", model, "--format", "png", std::string("--dpi=") + dpi});
    EXPECT_EQ(result.exit_code, 2) << dpi;
    EXPECT_EQ(result.out, "") << dpi;
    EXPECT_THAT(result.err, HasSubstr("whole number from 20 to 1200"));
  }
  const auto result = arbiter({"graph", model, "--format", "svg", "--dpi", "96"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("no dots"));
}

TEST(Graph, SaysWhichFormatsThereAre) {
  const auto result = arbiter({"graph", "m.xml", "--format", "gif"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("gif is none of svg, png"));
}

TEST(Graph, NeedsAModelOrADaemon) {
  EXPECT_EQ(arbiter({"graph"}).exit_code, 2);
  EXPECT_EQ(arbiter({"graph", "--follow"}).exit_code, 2);  // and a file
  EXPECT_EQ(arbiter({"graph", "m.xml", "--view", "upside-down"}).exit_code, 2);
  const TemporaryDirectory directory;
  const auto result = arbiter({"graph", "--live", "--instance", "nobody-has-this-one"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, Not(testing::IsEmpty()));
}

TEST(Graph, RefusesToOverwriteTheModel) {
  const TemporaryDirectory directory;
  const auto model = directory.write("m.dot", kOverrideModel);
  const auto result =
      arbiter({"graph", model, "-o",
               directory.path() + "/../" +
                   directory.path().substr(directory.path().rfind('/') + 1) + "/m.dot"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("would overwrite " + model));
  EXPECT_EQ(content_of(model), kOverrideModel);
}

TEST(Graph, RefusesToOverwriteTheApplicationThatSaysWhereThingsRun) {
  const TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kOverrideModel);
  const std::string text = "<application><name>x</name></application>";
  const auto hosts = directory.write("hosts.dot", text);
  const auto result = arbiter({"graph", model, "--hosts", hosts, "-o", hosts});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("--output " + hosts + " would overwrite the input"));
  EXPECT_EQ(content_of(hosts), text);
}

TEST(Graph, FollowsIntoAFileOnly) {
  for (const char* output : {"-", "/dev/stdout"}) {
    const auto result = arbiter({"graph", "--follow", "-o", output});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("--follow writes a file again at each change"));
  }
}

TEST(Graph, SaysWhichFileCannotBeWritten) {
  const TemporaryDirectory directory;
  const auto result = arbiter({"graph", directory.write("m.xml", kOverrideModel), "-o",
                               directory.path() + "/missing/a.dot"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("cannot write"));
}

}  // namespace
}  // namespace arbiter::test
