// A daemon dies, or is stopped, and another takes over.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include <arbiter/arbiter.hpp>

#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/threads.hpp"

namespace arbiter::test {
namespace {

std::string only(const std::string& source) {
  return rules(arbiter_at("/in", select("/" + source)));
}

TEST(Takeover, WhatIsOpenStaysOpenAndObeysTheNewModel) {
  Daemon daemon(only("a"));
  Node node("test");
  auto a = node.output_port<Number>("/a");
  auto b = node.output_port<Number>("/b");
  auto in = node.input_port<Number>("/in");
  EXPECT_EQ(a.publish(Number{1}).delivered, 1u);
  daemon.kill();
  EXPECT_EQ(a.publish(Number{2}).delivered, 1u);
  daemon.write_model(only("b"));
  daemon.restart();
  const auto status = daemon.status();
  EXPECT_EQ(status["model"]["generation"], 2);
  EXPECT_EQ(daemon.connection("/b", "/in")["state"], "connected");
  EXPECT_FALSE(in.take()) << "both are of /a, which is no longer selected";
  EXPECT_EQ(a.publish(Number{3}).delivered, 0u);
  EXPECT_EQ(b.publish(Number{4}).delivered, 1u);
  EXPECT_EQ(take_from(in), 4);
}

}  // namespace
}  // namespace arbiter::test
