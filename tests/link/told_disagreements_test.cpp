// Which disagreements are told where there are too many, or nobody can be told now.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "link/core/disagreements.hpp"

namespace arbiter::test {
namespace {

class TwoHostsDisagree : public testing::Test {
 protected:
  TwoHostsDisagree() {
    a_.host = "a";
    b_.host = "b";
    a_.incarnation = 1;
    b_.incarnation = 2;
  }
  std::vector<link::Disagreement> look(shm::Nanoseconds seconds) {
    return disagreements_.look({{&a_, 0}, {&b_, 0}}, seconds * 1'000'000'000);
  }

  link::HostCard a_;
  link::HostCard b_;
  link::Disagreements disagreements_;
};

// They may have the same sources open on purpose, and more of them than find a place.
TEST_F(TwoHostsDisagree, AnErrorFindsAPlaceAmongManyWarnings) {
  for (int i = 0; i < 1000; ++i) a_.outputs.push_back("/" + std::to_string(10'000 + i));
  b_.outputs = a_.outputs;
  static_cast<void>(look(10));
  EXPECT_EQ(look(12).size(), link::Disagreements::kMost);
  a_.inputs = b_.inputs = {"/p"};
  static_cast<void>(look(13));
  const auto news = look(15);
  ASSERT_EQ(news.size(), 1U);
  EXPECT_TRUE(news.front().is_error());
  EXPECT_EQ(disagreements_.standing().size(), link::Disagreements::kMost);
  EXPECT_EQ(disagreements_.standing().front().name, "/p");
  EXPECT_THAT(look(16), testing::IsEmpty());
}

TEST_F(TwoHostsDisagree, WhatNobodyCouldBeToldIsNewsAgain) {
  a_.inputs = b_.inputs = {"/p"};
  static_cast<void>(look(10));
  const auto news = look(12);
  ASSERT_EQ(news.size(), 1U);
  disagreements_.take_back(news.front());
  EXPECT_EQ(look(13).size(), 1U);
  EXPECT_THAT(look(14), testing::IsEmpty());
}

}  // namespace
}  // namespace arbiter::test
