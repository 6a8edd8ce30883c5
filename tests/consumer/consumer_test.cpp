// What a user's project sees: the package that `cmake --install` installs, found by find_package(),
// linked by arbiter::client alone, in C++17 and in C++20.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>
#include <string_view>

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

// What a page links to, as it names it: a file, a heading of one, or of the page itself.
struct Link {
  std::string file;
  std::string heading;
};

std::string text_of(const fs::path& page) {
  std::ifstream in(page);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<Link> links_of(const fs::path& page) {
  const std::string text = text_of(page);
  const std::regex link(R"(\]\(([^)#]*)#?([^)]*)\))");
  std::vector<Link> links;
  for (std::sregex_iterator it(text.begin(), text.end(), link), end; it != end; ++it) {
    if ((*it)[1].str().find("://") == std::string::npos) links.push_back({(*it)[1], (*it)[2]});
  }
  return links;
}

// As web sites of repositories name a heading: in small letters, without marks, with "-" between
// words.
std::string name_of(const std::string& heading) {
  std::string name;
  for (const char c : heading) {
    const bool is_mark = std::ispunct(static_cast<unsigned char>(c)) != 0 && c != '-' && c != '_';
    if (!is_mark) name += c == ' ' ? '-' : static_cast<char>(std::tolower(c));
  }
  return name;
}

// A second one of the same name has a number. A place may be named beside its heading.
std::set<std::string> headings_of(const fs::path& page) {
  std::istringstream in(text_of(page));
  std::set<std::string> names;
  bool is_code = false;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("```")) is_code = !is_code;
    constexpr std::string_view kPlace = "<a id=\"";
    if (line.starts_with(kPlace)) {
      names.insert(line.substr(kPlace.size(), line.find('"', kPlace.size()) - kPlace.size()));
    }
    if (is_code || !line.starts_with('#')) continue;
    const std::string name = name_of(line.substr(line.find_first_not_of("# ")));
    for (int i = 0; !names.insert(i == 0 ? name : name + "-" + std::to_string(i)).second;) ++i;
  }
  return names;
}

TEST(Consumer, BuildsWithPkgConfigToo) {
  const TemporaryDirectory directory;
  ASSERT_NO_FATAL_FAILURE(install(directory.path()));
  const ProgramResult flags =
      run_program({"/usr/bin/env", "PKG_CONFIG_PATH=" + directory.path() + "/lib/pkgconfig",
                   "pkg-config", "--cflags", "--libs", "arbiter"});
  ASSERT_EQ(flags.exit_code, 0) << flags.err;
  const std::string source = ARBITER_TEST_DATA "/project/consumer17.cpp";
  const std::string compile = CONSUMER_COMPILER " " CONSUMER_FLAGS " ";
  run({"/bin/sh", "-c",
       compile + "-std=c++17 " + source + " -o " + directory.path() + "/consumer " + flags.out});
  const ProgramResult older = run_program(
      {"/bin/sh", "-c", compile + "-std=c++14 -fsyntax-only " + source + " " + flags.out});
  EXPECT_NE(older.exit_code, 0);
  EXPECT_THAT(older.err, testing::HasSubstr("arbiter needs C++17 or later"));
}

TEST(Consumer, FindsWhatTheInstalledPagesLinkTo) {
  const TemporaryDirectory directory;
  ASSERT_NO_FATAL_FAILURE(install(directory.path()));
  std::size_t files = 0;
  std::size_t headings = 0;
  for (const auto& entry : fs::recursive_directory_iterator(directory.path() + "/share/doc")) {
    const fs::path page = entry.path();
    if (page.extension() != ".md") continue;
    for (const Link& to : links_of(page)) {
      const fs::path file = to.file.empty() ? page : page.parent_path() / to.file;
      files += to.file.empty() ? 0 : 1;
      EXPECT_TRUE(fs::exists(file)) << page << ": " << to.file;
      if (to.heading.empty()) continue;
      ++headings;
      EXPECT_TRUE(headings_of(file).contains(to.heading))
          << page << ": " << file << "#" << to.heading;
    }
  }
  EXPECT_GT(files, 40u);
  EXPECT_GT(headings, 100u);
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

std::vector<fs::path> units_in(const std::string& prefix) {
  std::vector<fs::path> units;
  for (const auto& each : fs::directory_iterator(prefix + "/lib/systemd/system")) {
    units.push_back(each.path());
  }
  return units;
}

constexpr const char* kSystemdAnalyze = "/usr/bin/systemd-analyze";

// No service manager is needed for it.
bool can_analyze() {
  if (!fs::exists(kSystemdAnalyze)) return false;
  return run_program({kSystemdAnalyze, "--help"}).out.find("--offline") != std::string::npos;
}

// What systemd has to say of that unit, and not of others that it looks at as well.
std::string complaints_about(const fs::path& unit) {
  const ProgramResult result =
      run_program({kSystemdAnalyze, "verify", "--man=no", "--recursive-errors=no", unit});
  std::istringstream lines(result.out + result.err);
  std::string complaints;
  for (std::string line; std::getline(lines, line);) {
    if (line.find(unit.filename()) != std::string::npos) complaints += line + "\n";
  }
  return result.exit_code == 0 ? complaints : complaints + "refused";
}

TEST(Consumer, IsGivenUnitsThatSystemdTakesAsTheyAre) {
  if (!can_analyze()) GTEST_SKIP() << "no systemd-analyze of systemd 250 or later";
  const TemporaryDirectory directory;
  ASSERT_NO_FATAL_FAILURE(install(directory.path()));
  const auto units = units_in(directory.path());
  EXPECT_EQ(units.size(), 4u);
  for (const fs::path& unit : units) EXPECT_EQ(complaints_about(unit), "") << unit;
  // It does find what is wrong.
  const fs::path misspelt = directory.path() + "/misspelt.service";
  std::ofstream(misspelt) << text_of(units.front()) << "[Service]\nProtectHom=yes\n";
  EXPECT_THAT(complaints_about(misspelt), testing::HasSubstr("ProtectHom"));
}

// A service without any sandbox has 9.6 on systemd's scale, one of systemd's own some 2.
TEST(Consumer, IsGivenUnitsThatSystemdHoldsForHardened) {
  if (!can_analyze()) GTEST_SKIP() << "no systemd-analyze of systemd 250 or later";
  const TemporaryDirectory directory;
  ASSERT_NO_FATAL_FAILURE(install(directory.path()));
  for (const fs::path& unit : units_in(directory.path())) {
    const ProgramResult result =
        run_program({kSystemdAnalyze, "security", "--offline=true", "--threshold=20", unit});
    EXPECT_EQ(result.exit_code, 0) << unit << "\n" << result.out << result.err;
  }
}

TEST(Consumer, IsGivenUnitsOfWhichTheDaemonsIsStartedFirst) {
  const TemporaryDirectory directory;
  ASSERT_NO_FATAL_FAILURE(install(directory.path()));
  for (const fs::path& unit : units_in(directory.path())) {
    if (unit.filename() == "arbiterd.service") continue;
    for (const std::string key : {"After", "Wants"}) {
      const auto named = first_of_each(unit, std::regex(key + "=(arbiterd\\.service)( .*)?"));
      EXPECT_EQ(named.size(), 1u) << unit << ": " << key;
    }
  }
}

TEST(Consumer, IsHelpedByEachProgram) {
  const TemporaryDirectory directory;
  ASSERT_NO_FATAL_FAILURE(install(directory.path()));
  std::size_t programs = 0;
  for (const auto& program : fs::directory_iterator(directory.path() + "/bin")) {
    ++programs;
    const ProgramResult help = run_program({program.path(), "--help"});
    EXPECT_EQ(help.exit_code, 0) << program;
    EXPECT_EQ(help.err, "") << program;
    EXPECT_THAT(help.out, testing::ContainsRegex("\nExamples?:\n  [^\n]+")) << program;
    EXPECT_THAT(help.out, testing::ContainsRegex("\nExit codes: 0 [^\n]+")) << program;
  }
  EXPECT_EQ(programs, 8u);
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
