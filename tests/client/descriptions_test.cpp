// What a component says of its ports, as the daemon hears it.
#include <gtest/gtest.h>
#include <poll.h>

#include <string>
#include <string_view>

#include <arbiter/arbiter.hpp>

#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

// Empty: the daemon has heard nothing, or that there is nothing.
std::string described(Daemon& daemon, const char* key = "described") {
  return daemon.source("/out").value(key, std::string());
}

// As a component that does nothing but wait for its descriptor.
void serve_until_described(Daemon& daemon, Node& node, const std::string& text) {
  while (described(daemon) != text) {
    pollfd news{node.service_fd(), POLLIN, 0};
    ASSERT_EQ(::poll(&news, 1, 10'000), 1) << "nothing would ever be said";
    node.service();
  }
}

// What comes too soon after another word is said later, and nobody rings for that.
TEST(Descriptions, WithoutAServiceThreadTheDescriptorTellsWhenTheLastOneIsDue) {
  Daemon daemon(single_model());
  Node node("test", {.service_thread = false});
  auto out = node.output_port<Number>("/out");
  out.describe("first");
  serve_until_described(daemon, node, "first");
  for (int i = 0; i < 100; ++i) {
    out.describe("word " + std::to_string(i));
    node.service();
  }
  serve_until_described(daemon, node, "word 99");
  out.describe("");
  serve_until_described(daemon, node, "");
}

TEST(Descriptions, AreTextsThatEndAtAZeroByte) {
  Daemon daemon(single_model());
  Node node("test", {.service_thread = false});
  auto out = node.output_port<Number>("/out");
  out.describe(std::string_view("a\0b", 3));
  serve_until_described(daemon, node, "a");
  out.describe(std::string(510, 'x') + "\u00e4");
  serve_until_described(daemon, node, std::string(510, 'x'));
}

}  // namespace
}  // namespace arbiter::test
