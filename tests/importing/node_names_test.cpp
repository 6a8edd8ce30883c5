#include "importing/node_names.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace arbiter::importing {
namespace {

struct Fit {
  std::string pattern;
  std::vector<std::string> nodes;
  std::vector<std::string> others;
};

TEST(NodeNames, FitAPatternAsRos2HasIt) {
  const std::vector<Fit> fits = {
      {"/**", {"/mux", "/a/mux", "/a/b/mux"}, {""}},
      {"/*", {"/mux"}, {"/a/mux"}},
      {"/*/mux", {"/a/mux"}, {"/mux", "/a/b/mux", "/a/mux2", "/a/other"}},
      {"/**/mux", {"/mux", "/a/mux", "/a/b/mux", "/mux/mux"}, {"/a/mux2", "/mux/other"}},
      {"/a/**", {"/a", "/a/mux", "/a/b/mux"}, {"/b/mux", "/ab/mux"}},
      {"/a/**/b/*", {"/a/b/mux", "/a/x/b/mux", "/a/b/b/mux", "/a/b/mux/b/mux"}, {"/a/mux", "/a/b"}},
      {"/**/a/**/mux", {"/a/mux", "/x/a/y/z/mux", "/a/mux/mux"}, {"/x/mux", "/mux/a"}},
      {"/other*/zz", {}, {"/mux", "/other/zz", "/other1/zz", "/othe/zz"}},
  };
  for (const Fit& fit : fits) {
    for (const auto& node : fit.nodes)
      EXPECT_TRUE(fits_node(fit.pattern, node)) << fit.pattern << node;
    for (const auto& node : fit.others)
      EXPECT_FALSE(fits_node(fit.pattern, node)) << fit.pattern << node;
  }
  EXPECT_FALSE(fits_node("/*/mux", "/*/mux"));
}

TEST(NodeNames, HaveWildcardsAsWholeWordsOnly) {
  for (const auto* good : {"/mux", "/*", "/**", "/a/*/mux", "/**/mux"}) {
    EXPECT_TRUE(is_good_pattern(good)) << good;
  }
  for (const auto* bad : {"/other*/zz", "/*mux", "/***", "/a/m*x"}) {
    EXPECT_FALSE(is_good_pattern(bad)) << bad;
  }
  EXPECT_TRUE(is_of_every_node("/**"));
  for (const auto* some : {"", "/mux", "/*", "/**/mux"})
    EXPECT_FALSE(is_of_every_node(some)) << some;
}

// A file may have a megabyte of them.
TEST(NodeNames, OfAnyLengthAreCompared) {
  std::string pattern;
  std::string node;
  for (int i = 0; i < 100'000; ++i) {
    pattern += "/**/a";
    node += "/a";
  }
  EXPECT_FALSE(fits_node(pattern + "/b", node));
  EXPECT_FALSE(fits_node(pattern, "/a/a"));
}

}  // namespace
}  // namespace arbiter::importing
