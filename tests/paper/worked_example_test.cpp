// The paper's Search and Track over time, T = 500 ms: the worked example of docs/semantics.md.
#include <gmock/gmock.h>

#include <fstream>
#include <sstream>

#include "rules/simulation.hpp"
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

}  // namespace
}  // namespace arbiter::test
