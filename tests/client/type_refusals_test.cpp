// What cannot be a type, and what a port does whose type is not the other's.
#include <gtest/gtest.h>

#include <array>
#include <string>

#include <arbiter/arbiter.hpp>

#include "shm/bell.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/raw_port.hpp"

namespace arbiter::test {
namespace {

// {} are options, for a type has no default.
static_assert(requires(Node & node) {
  node.output_port("/a", {});
  node.input_port("/a", {});
});

TEST(Types, WhatCannotBeATypeIsRefusedWithTheReason) {
  const auto why_not = [](const std::string& name, std::size_t size, std::size_t alignment) {
    return error_of([&] { static_cast<void>(Type(name, size, alignment)); });
  };
  EXPECT_NE(why_not("", 8, 8).find("1 to 239 bytes"), std::string::npos);
  EXPECT_NE(why_not(std::string(240, 'x'), 8, 8).find("1 to 239 bytes"), std::string::npos);
  EXPECT_EQ(why_not(std::string(239, 'x'), 8, 8), "no error");
  EXPECT_EQ(why_not("a\nb", 8, 8),
            "\"a\\nb\" cannot be a port's type: its name has a control character or an invisible "
            "one in it");
  EXPECT_NE(why_not(std::string("a\0b", 3), 8, 8).find("zero byte"), std::string::npos);
  EXPECT_NE(why_not(std::string(1, '\0'), 8, 8).find("zero byte"), std::string::npos);
  EXPECT_NE(why_not("a\u202eb", 8, 8).find("invisible"), std::string::npos);
  EXPECT_NE(why_not("a\xff", 8, 8).find("not UTF-8"), std::string::npos);
  EXPECT_NE(why_not("a", 0, 8).find("no bytes"), std::string::npos);
  EXPECT_EQ(why_not("a", 8, 0), "no error") << "it is variable";
  EXPECT_NE(why_not("a", 8, 3).find("power of two"), std::string::npos);
  EXPECT_NE(why_not("a", 8, 8192).find("at most 4096"), std::string::npos);
  EXPECT_NE(why_not("a", (std::size_t{1} << 40) + 1, 8).find("more than"), std::string::npos);
}

// What a component says of its type is judged by the daemon, which shows it to others.
TEST(Types, ATypeWhoseNameWouldMisleadIsNotTaken) {
  Daemon daemon(single_model());
  for (const char* name : {"Twist\x1b[2J", "Twist\nno", "Twist\xff", "Twist\u202e"}) {
    RawClient client(daemon.instance());
    client.hello();
    auto open = RawClient::message(wire::MessageKind::kOpenInput, "/in");
    open.type.set_name(name);
    open.type.size = open.type.alignment = 8;
    const auto segment = raw_input_segment();
    const shm::Bell bell;
    client.send(open, {segment.get(), bell.for_publishers().get()});
    const auto refused = client.expect(wire::MessageKind::kRefused);
    EXPECT_NE(std::string(refused.message.text_view()).find("the port's type"), std::string::npos);
  }
}

TEST(Types, AMismatchDeliversNothingAndIsRefused) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port("/out");
  auto in = node.input_port<Number>("/in");
  const std::array<std::byte, 8> bytes{};
  const Outcome outcome = out.publish(Bytes(bytes.data(), bytes.size()));
  EXPECT_EQ(outcome.delivered + outcome.discarded, 0u);
  EXPECT_EQ(outcome.refused, 1u);
  EXPECT_FALSE(in.take());
}

TEST(Types, AMismatchedSourceIsActiveAllTheSame) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port("/high");
  auto in = node.input_port<Number>("/in");
  high.signal();
  EXPECT_EQ(low.publish(Number{1}).discarded, 1u);
  EXPECT_EQ(in.winner(), std::nullopt) << "it is selected, and cannot deliver";
  EXPECT_TRUE(in.idle());
}

TEST(Types, ASuccessorOfTheRightTypeConnects) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  { auto wrong = node.output_port("/out"); }
  auto out = node.output_port<Number>("/out");
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(in), 1);
}

TEST(Types, AnUntypedInputGetsTheBytesOfATypedSample) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port("/in");
  auto out = node.output_port<Number>("/out");
  out.publish(Number{0x0102030405060708});
  auto sample = in.take();
  ASSERT_TRUE(sample);
  ASSERT_EQ(sample->size(), sizeof(Number));
  EXPECT_EQ(*reinterpret_cast<const std::int64_t*>(sample->data()), 0x0102030405060708);
}

}  // namespace
}  // namespace arbiter::test
