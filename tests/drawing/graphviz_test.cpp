// The program dot, and some that take its place.
#include "drawing/graphviz.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <string>

#include "tests/support/temporary_directory.hpp"

namespace arbiter::drawing {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

// While it lives, programs are looked for in its directory first; with `only`, nowhere else.
class Programs {
 public:
  explicit Programs(bool only = false) : path_(std::getenv("PATH")) {
    setenv("PATH", (directory_.path() + (only ? "" : ":" + path_)).c_str(), 1);
  }
  Programs(const Programs&) = delete;
  Programs& operator=(const Programs&) = delete;
  ~Programs() { setenv("PATH", path_.c_str(), 1); }

  void write_dot(const std::string& script) {
    const std::string program = directory_.write("dot", "#!/bin/sh\ncat > /dev/null\n" + script);
    ASSERT_EQ(chmod(program.c_str(), 0700), 0);
  }
  [[nodiscard]] std::string directory() const { return directory_.path(); }

 private:
  const test::TemporaryDirectory directory_;
  const std::string path_;
};

std::string why_not_drawn() {
  try {
    lay_out("digraph {}", "svg");
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "drawn";
}

// A dot that draws nothing until somebody writes a line to its FIFO.
TEST(Graphviz, WhoeverWaitsForItIsTold) {
  Programs programs;
  const std::string gate = programs.directory() + "/gate";
  ASSERT_EQ(mkfifo(gate.c_str(), 0600), 0);
  programs.write_dot("read line < " + gate + "\necho \"$line\"\n");
  int told = 0;
  const Waiting waiting{[&] {
                          if (++told == 2) std::ofstream(gate) << "a picture\n";
                        },
                        std::chrono::milliseconds(1)};
  EXPECT_EQ(lay_out("digraph {}", "svg", waiting).picture, "a picture\n");
  EXPECT_GE(told, 2);
}

TEST(Graphviz, WhereItIsMissingTheErrorSaysWhatToInstallAndWhatDoesWithout) {
  const Programs none(true);
  const std::string why = why_not_drawn();
  EXPECT_THAT(why, HasSubstr("apt install graphviz"));
  EXPECT_THAT(why, HasSubstr("--format dot"));
}

TEST(Graphviz, WhatItSaysWhenItFailsIsPassedOn) {
  Programs programs;
  programs.write_dot("echo 'out of paper' >&2\nexit 1\n");
  EXPECT_THAT(why_not_drawn(), HasSubstr("out of paper"));
}

TEST(Graphviz, ThatItHasMadeAPictureSmallerIsNoticed) {
  Programs programs;
  programs.write_dot(
      "echo 'dot: graph is too large for cairo-renderer bitmaps. Scaling by 0.5 to fit' >&2\n"
      "echo picture\n");
  EXPECT_TRUE(lay_out("digraph {}", "png").is_shrunk);
  programs.write_dot("echo picture\n");
  EXPECT_FALSE(lay_out("digraph {}", "png").is_shrunk);
}

TEST(Graphviz, DrawsWhereItIsInstalled) {
  EXPECT_THAT(lay_out("digraph { a -> b }", "svg").picture, StartsWith("<?xml"));
}

}  // namespace
}  // namespace arbiter::drawing
