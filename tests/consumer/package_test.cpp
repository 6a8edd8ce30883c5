// What a robot's system gets: the Debian package that `./run package` makes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <iterator>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/run_program.hpp"
#include "tests/support/temporary_directory.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

namespace fs = std::filesystem;

using testing::AllOf;
using testing::HasSubstr;

std::string output_of(const std::vector<std::string>& command) {
  const ProgramResult result = run_program(command);
  EXPECT_EQ(result.exit_code, 0) << command[1] << "\n" << result.out << result.err;
  return result.out;
}

// What is in it, and where it is read from.
struct Package {
  std::string file;
  std::string root;     // its files, as they will stand below /
  std::string control;  // what dpkg reads and runs

  explicit Package(const std::string& directory)
      : root(directory + "/root"), control(directory + "/control") {
    // By somebody who lets nobody read what he makes.
    output_of({"/bin/sh", "-c", "umask 077; exec \"$@\"", "sh", "/usr/bin/cpack", "--config",
               CONSUMER_BUILD "/CPackConfig.cmake", "-D", "CPACK_DEBIAN_COMPRESSION_TYPE=gzip",
               "-B", directory});
    for (const auto& each : fs::directory_iterator(directory)) {
      if (each.path().extension() == ".deb") file = each.path();
    }
    output_of({"/usr/bin/dpkg-deb", "--extract", file, root});
    output_of({"/usr/bin/dpkg-deb", "--control", file, control});
  }
  [[nodiscard]] std::string field(const std::string& name) const {
    return output_of({"/usr/bin/dpkg-deb", "--field", file, name});
  }
};

void expect_files_of_a_system(const Package& package) {
  for (const char* const file :
       {"/usr/bin/arbiterd", "/usr/bin/arbiter", "/usr/bin/arbiter-link",
        "/usr/bin/arbiter-gateway-dds", "/usr/bin/arbiter-gateway-iceoryx",
        "/usr/include/arbiter/arbiter.hpp", "/usr/lib/sysusers.d/arbiter.conf",
        "/usr/share/doc/arbiter/README.md", "/etc/arbiter/model.xml", "/etc/arbiter/policy"}) {
    EXPECT_TRUE(fs::exists(package.root + file)) << file;
  }
  EXPECT_THAT(content_of(package.root + "/usr/lib/systemd/system/arbiterd.service"),
              AllOf(HasSubstr("\nExecStart=/usr/bin/arbiterd "),
                    HasSubstr(" --policy /etc/arbiter/policy\"")));
  EXPECT_FALSE(fs::exists(package.root + "/usr/local"));
  EXPECT_THAT(output_of({package.root + "/usr/bin/arbiterd", "--version"}), HasSubstr("arbiterd "));
}

// A robot's own model and policy are left alone.
void expect_configuration(const Package& package) {
  std::set<std::string> files;
  for (const auto& each : fs::recursive_directory_iterator(package.root + "/etc")) {
    if (each.is_regular_file()) files.insert(each.path().string().substr(package.root.size()));
  }
  std::istringstream lines(content_of(package.control + "/conffiles"));
  EXPECT_EQ(std::set<std::string>(std::istream_iterator<std::string>(lines), {}), files);
}

// -rw-r--r-- root/root ...
void expect_all_to_read_and_root_to_write(const Package& package) {
  std::istringstream lines(output_of({"/usr/bin/dpkg-deb", "--contents", package.file}));
  std::size_t files = 0;
  for (std::string line; std::getline(lines, line); ++files) {
    EXPECT_THAT(line, HasSubstr(" root/root "));
    if (line[0] == 'l') continue;
    const bool is_directory = line[0] == 'd';
    EXPECT_EQ(line.substr(4, 2), "r-") << line;
    EXPECT_EQ(line.substr(7, 2), "r-") << line;
    EXPECT_TRUE(!is_directory || line[9] == 'x') << line;
  }
  EXPECT_GT(files, 50u);
}

void expect_scripts(const Package& package) {
  for (const char* const name : {"/postinst", "/prerm", "/postrm"}) {
    const std::string script = package.control + name;
    EXPECT_EQ(fs::status(script).permissions(), fs::perms(0755)) << script;
    output_of({"/bin/sh", "-n", script});
  }
}

// systemd may refuse to reload, as where /run is full: dpkg must not stop at that.
TEST(DebianPackage, IsInstalledAndRemovedWhereSystemdRefuses) {
  const TemporaryDirectory directory;
  fs::permissions(directory.write("systemctl", "#!/bin/sh\nexit 1\n"), fs::perms(0755));
  fs::permissions(directory.write("systemd-sysusers", "#!/bin/sh\n"), fs::perms(0755));
  // There systemd runs.
  const std::string begin =
      "mount -t tmpfs none /run && mkdir -p /run/systemd/system && exec \"$@\"";
  const auto run = [&](const std::vector<std::string>& command) {
    std::vector<std::string> all{"/usr/bin/unshare",
                                 "-rm",
                                 "/bin/sh",
                                 "-c",
                                 begin,
                                 "sh",
                                 "/usr/bin/env",
                                 "PATH=" + directory.path() + ":/usr/bin:/bin"};
    all.insert(all.end(), command.begin(), command.end());
    return run_program(all);
  };
  if (run({"/bin/true"}).exit_code != 0) GTEST_SKIP() << "no namespace of its own";
  EXPECT_NE(run({"systemctl"}).exit_code, 0);
  using Command = std::vector<std::string>;
  for (const Command& each : {Command{"postinst", "configure"}, Command{"prerm", "remove"},
                              Command{"postrm", "remove"}, Command{"postrm", "purge"}}) {
    const auto result = run({CONSUMER_PACKAGING "/" + each[0], each[1]});
    EXPECT_EQ(result.exit_code, 0) << each[0] << ' ' << each[1] << '\n' << result.err;
  }
}

// To make it takes longer than all that is asked of it.
TEST(DebianPackage, IsWhatASystemInstalls) {
  const TemporaryDirectory directory;
  const Package package(directory.path());
  ASSERT_FALSE(testing::Test::HasFailure());
  expect_files_of_a_system(package);
  expect_configuration(package);
  expect_all_to_read_and_root_to_write(package);
  expect_scripts(package);
  EXPECT_EQ(package.field("Package"), "arbiter\n");
  EXPECT_THAT(package.field("Depends"),
              AllOf(HasSubstr("libc6 (>= 2.36)"), HasSubstr("libsystemd0"), HasSubstr("libstdc++6"),
                    HasSubstr("libddsc0")));
}

}  // namespace
}  // namespace arbiter::test
