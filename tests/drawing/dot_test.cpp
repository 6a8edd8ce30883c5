#include "drawing/dot.hpp"

#include <gtest/gtest.h>

namespace arbiter::drawing {
namespace {

TEST(Dot, TextInQuotesMeansNothingToGraphviz) {
  EXPECT_EQ(quoted("plain"), "\"plain\"");
  EXPECT_EQ(quoted("a \"b\" \\N\nc"), "\"a \\\"b\\\" \\\\N\\nc\"");
  EXPECT_EQ(quoted("&amp; <b>"), "\"&amp;amp; <b>\"");
  EXPECT_EQ(quoted("größer ∧"), "\"größer ∧\"");
}

TEST(Dot, TextInTablesMeansNothingToGraphviz) {
  EXPECT_EQ(html("a<b> & \"c\""), "a&lt;b&gt; &amp; &quot;c&quot;");
  EXPECT_EQ(html("&lt;"), "&amp;lt;");
  EXPECT_EQ(html("one\ntwo"), "one<BR/>two");
  EXPECT_EQ(html("größer ∧"), "größer ∧");
}

// An application file may have names in any encoding.
TEST(Dot, WhatCannotBeDrawnIsMadeVisible) {
  EXPECT_EQ(html("/gr\xf6\xdf"
                 "er\x01"),
            "/gr\xef\xbf\xbd\xef\xbf\xbd"
            "er\xef\xbf\xbd");
  EXPECT_EQ(quoted("\x80"), "\"\xef\xbf\xbd\"");
  EXPECT_EQ(html("/\xef\xbf\xbe\xef\xbf\xbf"), "/\xef\xbf\xbd\xef\xbf\xbd");
}

TEST(Dot, StatementsAreIndentedAndEmptyAttributesLeftOut) {
  DotWriter out;
  out.open("digraph g");
  out.statement("a -> b", {{"color", "red"}, {"style", ""}, {"width", "2"}});
  out.open("subgraph cluster_1");
  out.attribute("label", "\"x\"");
  out.statement("c");
  out.close();
  out.close();
  EXPECT_EQ(out.take(),
            "digraph g {\n"
            "  a -> b [color=red width=2]\n"
            "  subgraph cluster_1 {\n"
            "    label=\"x\"\n"
            "    c\n"
            "  }\n"
            "}\n");
}

}  // namespace
}  // namespace arbiter::drawing
