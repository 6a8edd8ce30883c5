// ./run demo ros2: with all its processes, as its page says.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "tests/gateway/dds/scene.hpp"
#include "tests/support/run_program.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

using ::testing::ElementsAre;

// What a base was told, by the list at the end; without where it stood.
struct Told {
  std::vector<std::string> drives;
  int stood = 0;
};
Told told(const std::string& base, const std::string& output) {
  Told result;
  std::istringstream lines(output.substr(output.find(base + ", the base:\n")));
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line) && !line.empty()) {
    const std::string command = line.substr(2);
    if (command == "stands") {
      ++result.stood;
    } else if (result.drives.empty() || result.drives.back() != command) {
      result.drives.push_back(command);
    }
  }
  return result;
}

// As it is installed, beside a daemon and a gateway: it finds its nodes and its model from there.
TEST(Ros2Demo, TheBaseBehindArbiterStandsWhereTheOtherDrivesOn) {
  const OwnDomain domain;
  const TemporaryDirectory prefix;
  const auto installed = run_program(
      {ARBITER_CMAKE, "-DCMAKE_INSTALL_PREFIX=" + prefix.path(), "-P", ARBITER_INSTALL_DEMO});
  ASSERT_EQ(installed.exit_code, 0) << installed.err;
  const std::string programs = prefix.path() + "/bin/";
  for (const char* const program : {"arbiterd", "arbiter-gateway-dds"}) {
    std::filesystem::create_symlink(std::string(ARBITER_PROGRAMS) + "/" + program,
                                    programs + program);
  }
  const auto result = run_program({programs + "ros2-demo", "--lines", "--seconds", "15", "--domain",
                                   std::to_string(domain.number())});
  const std::string navigation = "drives 0.60 m/s, turns 0.35 rad/s";
  const std::string teleop = "drives 0.30 m/s, turns -0.90 rad/s";
  const Told arbiter = told("Arbiter", result.out);
  EXPECT_THAT(arbiter.drives, ElementsAre(navigation, teleop, navigation)) << result.out;
  EXPECT_GE(arbiter.stood, 2) << result.out;  // more often on a machine that is very busy
  const Told mux = told("twist_mux", result.out);
  EXPECT_THAT(mux.drives, ElementsAre(navigation, teleop, navigation)) << result.out;
  EXPECT_EQ(mux.stood, 0) << result.out;
}

TEST(Ros2Demo, EachNodeHasAHelp) {
  for (const std::string node : {"base", "e_stop", "mux", "navigation", "teleop"}) {
    const auto result = run_program({std::string(ARBITER_PROGRAMS) + "/ros2/" + node, "--help"});
    EXPECT_EQ(result.exit_code, 0) << node << result.err;
    EXPECT_NE(result.out.find("Usage: " + node), std::string::npos) << result.out;
  }
}

TEST(Ros2Demo, ATimeThatIsNoneIsRefused) {
  for (const char* const seconds : {"nan", "-nan", "inf", "0", "-20", "", "20s", "1e400"}) {
    const auto result =
        run_program({std::string(ARBITER_PROGRAMS) + "/ros2-demo", "--seconds", seconds});
    EXPECT_EQ(result.exit_code, 2) << seconds << result.out << result.err;
    EXPECT_NE(result.err.find("--seconds"), std::string::npos) << seconds << result.err;
  }
}

}  // namespace
}  // namespace arbiter::test
