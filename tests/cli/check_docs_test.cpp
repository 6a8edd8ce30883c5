// The examples of docs/checking.md: each file that it shows is written, each command that it shows
// is run, and has to say what stands there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "tests/support/run_program.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

std::vector<std::string> words_of(const std::string& line) {
  std::istringstream stream(line);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

class Examples {
 public:
  void run(std::istream& page) {
    std::string name;  // of the file that the next block is
    for (std::string line; std::getline(page, line);) {
      if (line.starts_with("```")) {
        const std::string kind = line.substr(3);
        std::vector<std::string> block;
        while (std::getline(page, line) && line != "```") block.push_back(line);
        if (kind == "console") {
          run_commands(block);
        } else if (!name.empty()) {
          std::string content;
          for (const auto& each : block) content += each + "\n";
          directory_.write(name, content);
          ++files_;
        }
        name.clear();
      } else if (line.starts_with('`') && line.ends_with("`:")) {
        name = line.substr(1, line.size() - 3);
      }
    }
  }

  [[nodiscard]] int commands() const { return commands_; }
  [[nodiscard]] int files() const { return files_; }

 private:
  void run_commands(const std::vector<std::string>& block) {
    for (std::size_t i = 0; i < block.size();) {
      ASSERT_TRUE(block[i].starts_with("$ ")) << block[i];
      const std::string command = block[i++].substr(2);
      std::string expected;
      while (i < block.size() && !block[i].starts_with("$ ")) expected += block[i++] + "\n";
      SCOPED_TRACE(command);
      ++commands_;
      if (command == "echo $?") {
        EXPECT_EQ(std::to_string(exit_code_) + "\n", expected);
        continue;
      }
      auto words = words_of(command);
      ASSERT_EQ(words.at(0), "arbiter");
      words[0] = std::string(ARBITER_PROGRAMS) + "/arbiter";
      words.insert(words.begin(), {"/usr/bin/env", "-C", directory_.path()});
      const auto result = run_program(words);
      exit_code_ = result.exit_code;
      EXPECT_EQ(result.err + result.out, expected);
    }
  }

  TemporaryDirectory directory_;
  int commands_ = 0, files_ = 0, exit_code_ = -1;
};

TEST(CheckDocs, EveryExampleSaysWhatThePageSays) {
  std::ifstream page(std::string(ARBITER_TEST_DATA) + "/../../docs/checking.md");
  ASSERT_TRUE(page.is_open());
  Examples examples;
  examples.run(page);
  EXPECT_GE(examples.files(), 7);
  EXPECT_GE(examples.commands(), 9);
}

}  // namespace
}  // namespace arbiter::test
