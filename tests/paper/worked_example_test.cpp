// The paper's Search and Track over time, T = 500 ms: the worked example of docs/semantics.md.
#include <gmock/gmock.h>

#include <fstream>
#include <sstream>

#include "rules/explain/simulation.hpp"
#include "tests/paper/paper_model.hpp"
#include "tests/support/run_program.hpp"

namespace arbiter::test {
namespace {

const std::string kTrace = ARBITER_TEST_DATA "/worked_example_trace.csv";
const std::string kOutcome = ARBITER_TEST_DATA "/worked_example_outcome.csv";

std::string content_of(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream content;
  content << file.rdbuf();
  return content.str();
}

TEST(WorkedExample, ComesOutAsTheTableSays) {
  auto model = search_and_track();
  rules::Simulation simulation(model.compiled);
  std::ostringstream out;
  rules::write_outcome_header(out);
  for (const auto& event : rules::read_trace(kTrace, model.diagnostics)) {
    for (const auto& row : simulation.step(event)) rules::write_outcome(out, row);
  }
  EXPECT_FALSE(model.diagnostics.has_errors());
  EXPECT_EQ(out.str(), content_of(kOutcome));
}

TEST(WorkedExample, ComesOutOfTheProgramToo) {
  const std::string folder = ARBITER_EXAMPLES "/search_and_track";
  for (const bool with_application : {false, true}) {
    std::vector<std::string> command = {ARBITER_PROGRAMS "/arbiter", "simulate",
                                        folder + "/search_and_track.xml", "--trace", kTrace};
    if (with_application) {
      command.insert(command.end(), {"--application", folder + "/application.xml"});
    }
    const auto result = run_program(command);
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_EQ(result.err, "");
    EXPECT_EQ(result.out, content_of(kOutcome));
  }
}

// `simulate --why`, all of it: what changed each winner, and why each arrival was discarded.
TEST(WorkedExample, IsExplained) {
  const std::string model = ARBITER_EXAMPLES "/search_and_track/search_and_track.xml";
  const auto result = run_program(
      {ARBITER_PROGRAMS "/arbiter", "simulate", model, "--trace", kTrace, "--why=/Gaze/pos:i"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
  const std::string at = "  /Gaze/pos:i  ";
  const std::string follow_face =
      "inhibited by behaviour \"Follow Face\" (" + model + ":42): /Face/pos:o is active (arrived ";
  const std::string track_object =
      "inhibited by behaviour \"Track Object\" through meta-behaviour \"Be Curious\" (" + model +
      ":52): /Object/pos:o is active (arrived ";
  const std::string condition =
      "the condition of behaviour \"Track Object\", ¬/collision:o, is false (" + model +
      ":51): /collision:o is active (arrived ";
  EXPECT_EQ(
      result.out,
      "0.000 s" + at + "idle -> /RandomLook/pos:o  because /RandomLook/pos:o became active\n" +
          "0.100 s" + at +
          "/RandomLook/pos:o -> /Face/pos:o  because /Face/pos:o became active; "
          "/RandomLook/pos:o is " +
          follow_face + "just now, T 500ms)\n" + "0.150 s" + at +
          "/RandomLook/pos:o discarded: " + follow_face + "50 ms ago, T 500ms)\n" + "0.200 s" + at +
          "/Face/pos:o -> /Object/pos:o  because /Object/pos:o became active; "
          "/Face/pos:o is " +
          track_object + "just now, T 500ms)\n" + "0.250 s" + at +
          "/Face/pos:o discarded: " + track_object + "50 ms ago, T 500ms)\n" + "0.350 s" + at +
          "/Object/pos:o -> idle  because /collision:o became active; "
          "/Object/pos:o is out: " +
          condition + "just now, T 500ms)\n" + "0.400 s" + at +
          "/Object/pos:o discarded: " + condition + "50 ms ago, T 500ms)\n" + "0.850 s" + at +
          "idle -> /Object/pos:o  because /collision:o went inactive, "
          "500 ms after its last arrival\n" +
          "1.350 s" + at +
          "/Object/pos:o -> idle  because /Object/pos:o went inactive, "
          "500 ms after its last arrival\n" +
          "1.400 s" + at + "idle -> /RandomLook/pos:o  because /RandomLook/pos:o became active\n");
  // The docs show it, run where the model is.
  std::string shown = result.out;
  const std::string folder = ARBITER_EXAMPLES "/search_and_track/";
  for (auto at_path = shown.find(folder); at_path != std::string::npos;
       at_path = shown.find(folder)) {
    shown.erase(at_path, folder.size());
  }
  const std::string docs = content_of(ARBITER_EXAMPLES "/../docs/explaining.md");
  EXPECT_NE(docs.find("--why=/Gaze/pos:i\n" + shown + "```\n"), std::string::npos);
}

}  // namespace
}  // namespace arbiter::test
