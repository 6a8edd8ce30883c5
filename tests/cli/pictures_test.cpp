// The documentation's pictures are what arbiter draws; docs/pictures/draw draws them anew.
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include "tests/support/run_program.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

const std::string kPictures = ARBITER_SOURCE "/docs/pictures/";

TEST(Pictures, OfTheDocumentationAreWhatArbiterDraws) {
  std::istringstream list(content_of(kPictures + "list"));
  int count = 0;
  for (std::string name, arguments; list >> name && std::getline(list, arguments); ++count) {
    SCOPED_TRACE(name + ": docs/pictures/draw draws it anew");
    const std::string dot = content_of(kPictures + name + ".dot");
    const auto drawn = run_program({"/bin/sh", "-c",
                                    "cd '" ARBITER_SOURCE "' && '" ARBITER_PROGRAMS
                                    "/arbiter' graph --format dot" +
                                        arguments});
    EXPECT_EQ(drawn.out, dot);
    const auto sum = run_program({"/bin/sh", "-c", "sha256sum | cut -d ' ' -f 1"}, dot);
    const std::string svg = content_of(kPictures + name + ".svg");
    EXPECT_TRUE(svg.ends_with("<!-- dot: " + sum.out.substr(0, 64) + " -->\n"))
        << "the SVG is of another DOT";
  }
  EXPECT_GE(count, 4);
  for (const auto& entry : std::filesystem::directory_iterator(kPictures)) {
    const auto& path = entry.path();
    if (path.extension() != ".svg") continue;
    const std::string name = path.stem().string();
    const bool is_listed = content_of(kPictures + "list").find(name + " ") != std::string::npos;
    // Pictures of a terminal are not of DOT: each has a script of its own.
    EXPECT_TRUE(is_listed || std::filesystem::exists(kPictures + "draw-" + name))
        << path << " is drawn by nobody";
  }
}

}  // namespace
}  // namespace arbiter::test
