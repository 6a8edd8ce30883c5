#include "importing/topic_names.hpp"

#include <gtest/gtest.h>

namespace arbiter::importing {
namespace {

TEST(TopicNames, AreResolvedAsRosDoes) {
  const NodeName root{"/", "twist_mux"};
  const NodeName robot = split_node("/robot/arm/mux");
  EXPECT_EQ(robot.name_space, "/robot/arm");
  EXPECT_EQ(robot.name, "mux");
  EXPECT_EQ(split_node("/mux").name_space, "/");
  const auto plain = Relative::kToNamespace;
  EXPECT_EQ(resolve_topic("joy_vel", root, plain), "/joy_vel");
  EXPECT_EQ(resolve_topic("input/joy", root, plain), "/input/joy");
  EXPECT_EQ(resolve_topic("/joy_vel", robot, plain), "/joy_vel");
  EXPECT_EQ(resolve_topic("joy_vel", robot, plain), "/robot/arm/joy_vel");
  EXPECT_EQ(resolve_topic("~/joy_vel", robot, plain), "/robot/arm/mux/joy_vel");
  EXPECT_EQ(resolve_topic("joy_vel", robot, Relative::kToNode), "/robot/arm/mux/joy_vel");
  EXPECT_EQ(resolve_topic("/joy_vel", robot, Relative::kToNode), "/joy_vel");
}

TEST(TopicNames, WhatRosRefusesIsNone) {
  for (const char* name : {"", "/", "//a", "a/", "a//b", "9a", "/a/9", "a b", "a-b", "{node}/a",
                           "~", "~a", "a\"b", "\xc3\xa9", "a<b>", "a\n"}) {
    EXPECT_FALSE(resolve_topic(name, {"/", "n"}, Relative::kToNamespace)) << name;
  }
  EXPECT_FALSE(resolve_topic(std::string(300, 'a'), {"/", "n"}, Relative::kToNamespace));
}

}  // namespace
}  // namespace arbiter::importing
