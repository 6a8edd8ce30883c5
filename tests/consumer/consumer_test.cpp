// What a user's project sees: the package that `cmake --install` installs, found by find_package(),
// linked by arbiter::client alone, in C++17 and in C++20.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>

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

void install(const std::string& prefix) {
  run({CONSUMER_CMAKE, "--install", CONSUMER_BUILD, "--prefix", prefix});
}

// The files that a page links to, as it names them.
std::vector<std::string> links_of(const fs::path& page) {
  std::ifstream in(page);
  const std::string text(std::istreambuf_iterator<char>(in), {});
  const std::regex link(R"(\]\(([^)#]+)[^)]*\))");
  std::vector<std::string> links;
  for (std::sregex_iterator it(text.begin(), text.end(), link), end; it != end; ++it) {
    if (const std::string to = (*it)[1]; to.find("://") == std::string::npos) links.push_back(to);
  }
  return links;
}

TEST(Consumer, FindsWhatTheInstalledPagesLinkTo) {
  const TemporaryDirectory directory;
  ASSERT_NO_FATAL_FAILURE(install(directory.path()));
  std::size_t links = 0;
  for (const auto& entry : fs::recursive_directory_iterator(directory.path() + "/share/doc")) {
    if (entry.path().extension() != ".md") continue;
    for (const auto& to : links_of(entry.path())) {
      ++links;
      EXPECT_TRUE(fs::exists(entry.path().parent_path() / to)) << entry.path() << ": " << to;
    }
  }
  EXPECT_GT(links, 40u);
}

std::set<std::string> first_of_each(const fs::path& file, const std::regex& line) {
  std::set<std::string> found;
  std::ifstream in(file);
  for (std::string text; std::getline(in, text);) {
    if (std::smatch match; std::regex_match(text, match, line)) found.insert(match[1]);
  }
  return found;
}

// arbiterd refuses a policy with a user who does not exist, and one whom systemd makes for a
// service exists only while that runs.
TEST(Consumer, FindsTheUsersOfServicesInTheListOfThoseToBeMade) {
  const TemporaryDirectory directory;
  ASSERT_NO_FATAL_FAILURE(install(directory.path()));
  const fs::path lib = directory.path() + "/lib";
  std::set<std::string> users;
  for (const auto& unit : fs::directory_iterator(lib / "systemd/system")) {
    if (unit.path().filename() == "arbiterd.service") continue;  // it reads the policy
    users.merge(first_of_each(unit.path(), std::regex("User=(.+)")));
  }
  EXPECT_EQ(users.size(), 3u);
  // Its last field goes into a file whose fields end with colons.
  const std::regex line(R"re(u (\S+) +- "[^:]+")re");
  EXPECT_EQ(first_of_each(lib / "sysusers.d/arbiter.conf", line), users);
}

TEST(Consumer, NeedsAtMost15Megabytes) {
  if (std::string(CONSUMER_BUILD_TYPE) != "RelWithDebInfo") return;  // of what ships
  const TemporaryDirectory directory;
  ASSERT_NO_FATAL_FAILURE(install(directory.path()));
  std::uintmax_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(directory.path())) {
    if (entry.is_regular_file() && !entry.is_symlink()) bytes += entry.file_size();
  }
  EXPECT_LE(bytes, 15'000'000u);
}

TEST(Consumer, BuildsAndRunsAgainstTheInstalledPackage) {
  const TemporaryDirectory directory;
  const std::string prefix = directory.path() + "/prefix";
  const std::string build = directory.path() + "/build";
  ASSERT_NO_FATAL_FAILURE(install(prefix));
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
