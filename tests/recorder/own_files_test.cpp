// Which files a flight recorder removes.
#include "recorder/own_files.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/temporary_directory.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

// As the list has it; an older recorder wrote the first two numbers alone.
std::string numbers_of(const std::string& path, bool is_older = false) {
  struct stat there {};
  EXPECT_EQ(::lstat(path.c_str(), &there), 0);
  const std::string first = std::to_string(there.st_dev) + ' ' + std::to_string(there.st_ino) + ' ';
  const auto modified = there.st_mtim.tv_sec * 1'000'000'000 + there.st_mtim.tv_nsec;
  if (is_older) return first;
  return first + std::to_string(there.st_size) + ' ' + std::to_string(modified) + ' ';
}

// In a directory that others may write to, the list may be made up.
TEST(OwnFiles, ForgetsWhatAListSaysOfOthers) {
  const TemporaryDirectory directory;
  std::filesystem::create_directory(directory.file("below"));
  std::string list;
  std::vector<std::string> others;
  for (const char* name :
       {"other-1.mcap", "flight-1.csv", "below/../flight-2.mcap", "below/flight-3.mcap"}) {
    const std::string path = directory.write(name, "x");
    others.push_back(path);
    list += numbers_of(path) + name + '\n';
  }
  const std::string own = directory.write("flight-5.mcap", "x");
  list += numbers_of(own) + "flight-5.mcap\n";
  const std::string planted = directory.write("planted", list + "no line\n1\n");
  std::filesystem::create_symlink(planted, directory.file("flight.files"));
  const std::string prefix = directory.file("flight");
  const std::string first = directory.write("flight-6.mcap", "x");
  EXPECT_TRUE(recorder::OwnFiles(prefix, 1).add(first).empty()) << "a link is no list";
  std::filesystem::remove(directory.file("flight.files"));
  std::filesystem::copy_file(planted, directory.file("flight.files"));
  const std::string second = directory.write("flight-7.mcap", "x");
  EXPECT_EQ(recorder::OwnFiles(prefix, 1).add(second), std::vector<std::string>{own});
  for (const std::string& other : others) EXPECT_TRUE(std::filesystem::exists(other)) << other;
}

// The file system gives the inode of a file that was removed to the next one.
TEST(OwnFiles, ForgetsAFileThatHasOtherContent) {
  const TemporaryDirectory directory;
  const std::string prefix = directory.file("flight");
  const std::string changed = directory.write("flight-1.mcap", "ours");
  const std::string touched = directory.write("flight-2.mcap", "ours");
  recorder::OwnFiles files(prefix, 2);
  EXPECT_TRUE(files.add(changed).empty());
  EXPECT_TRUE(files.add(touched).empty());
  std::ofstream(changed) << "theirs, and longer";
  const timespec times[2] = {{1, 0}, {1, 2}};
  ASSERT_EQ(::utimensat(AT_FDCWD, touched.c_str(), times, 0), 0);
  const std::string last = directory.write("flight-3.mcap", "ours");
  EXPECT_TRUE(recorder::OwnFiles(prefix, 1).add(last).empty()) << "of the list";
  EXPECT_TRUE(files.add(last).empty());
  EXPECT_TRUE(files.add(directory.write("flight-4.mcap", "ours")).empty());
  EXPECT_EQ(files.remove_oldest(), last);
  EXPECT_EQ(content_of(changed), "theirs, and longer");
  EXPECT_EQ(content_of(touched), "ours");
}

// It says too little of its files.
TEST(OwnFiles, LeavesAloneWhatTheListOfAnOlderRecorderHas) {
  const TemporaryDirectory directory;
  const std::string prefix = directory.file("flight");
  const std::string older = directory.write("flight-1.mcap", "x");
  directory.write("flight.files", numbers_of(older, true) + "flight-1.mcap\n");
  const std::string own = directory.write("flight-2.mcap", "x");
  EXPECT_TRUE(recorder::OwnFiles(prefix, 1).add(own).empty());
  EXPECT_EQ(recorder::OwnFiles(prefix, 1).add(directory.write("flight-3.mcap", "x")),
            std::vector<std::string>{own});
  EXPECT_TRUE(std::filesystem::exists(older));
}

}  // namespace
}  // namespace arbiter::test
