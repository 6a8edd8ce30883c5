// What a user's project sees: the package that `cmake --install` installs, found by find_package(),
// linked by arbiter::client alone, in C++17 and in C++20.
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/daemon.hpp"
#include "tests/support/run_program.hpp"

namespace arbiter::test {
namespace {

namespace fs = std::filesystem;

const std::string kModel =
    "<behaviors timeout='forever'><arbiter at='/Arm/pos:i'><select from='/Object/pos:o'/>"
    "</arbiter></behaviors>";

void run(const std::vector<std::string>& command) {
  const ProgramResult result = run_program(command);
  ASSERT_EQ(result.exit_code, 0) << command[1] << "\n" << result.out << result.err;
}

TEST(Consumer, BuildsAndRunsAgainstTheInstalledPackage) {
  const TemporaryDirectory directory;
  const std::string prefix = directory.path() + "/prefix";
  const std::string build = directory.path() + "/build";
  ASSERT_NO_FATAL_FAILURE(run({CONSUMER_CMAKE, "--install", CONSUMER_BUILD, "--prefix", prefix}));
  EXPECT_TRUE(fs::exists(prefix + "/include/arbiter/arbiter.hpp"));
  EXPECT_TRUE(fs::exists(prefix + "/bin/arbiterd"));
  // The sources are copied, so that nothing of ours is found by the way.
  fs::copy(std::string(ARBITER_TEST_DATA) + "/project", directory.path() + "/project");
  ASSERT_NO_FATAL_FAILURE(
      run({CONSUMER_CMAKE, "-S", directory.path() + "/project", "-B", build, "-G",
           CONSUMER_GENERATOR, "-DCMAKE_PREFIX_PATH=" + prefix,
           "-DCMAKE_CXX_COMPILER=" CONSUMER_COMPILER, "-DCMAKE_CXX_FLAGS=" CONSUMER_FLAGS}));
  ASSERT_NO_FATAL_FAILURE(run({CONSUMER_CMAKE, "--build", build}));
  for (const char* program : {"/consumer17", "/consumer20"}) {
    Daemon daemon(kModel);
    EXPECT_NO_FATAL_FAILURE(run({build + program, daemon.instance()}));
  }
}

}  // namespace
}  // namespace arbiter::test
