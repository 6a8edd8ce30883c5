// The program dot, and one that takes its place.
#include "drawing/graphviz.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <string>

#include "tests/support/temporary_directory.hpp"

namespace arbiter::drawing {
namespace {

// A dot that draws nothing until somebody writes a line to its FIFO.
TEST(Graphviz, WhoeverWaitsForItIsTold) {
  const test::TemporaryDirectory directory;
  const std::string gate = directory.path() + "/gate";
  ASSERT_EQ(mkfifo(gate.c_str(), 0600), 0);
  const std::string program =
      directory.write("dot", "#!/bin/sh\nread line < " + gate + "\necho \"$line\"\n");
  ASSERT_EQ(chmod(program.c_str(), 0700), 0);
  const std::string path = std::getenv("PATH");
  ASSERT_EQ(setenv("PATH", (directory.path() + ":" + path).c_str(), 1), 0);
  int told = 0;
  const Waiting waiting{[&] {
                          if (++told == 2) std::ofstream(gate) << "a picture\n";
                        },
                        std::chrono::milliseconds(1), std::chrono::milliseconds(1)};
  EXPECT_EQ(lay_out("digraph {}", "svg", waiting), "a picture\n");
  EXPECT_GE(told, 2);
  setenv("PATH", path.c_str(), 1);
}

}  // namespace
}  // namespace arbiter::drawing
