// What a port carries: type name, size and alignment are checked at both ends.
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <stdexcept>
#include <string>

#include <arbiter/arbiter.hpp>

#include "shm/bell.hpp"
#include "shm/output_segment.hpp"
#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/raw_port.hpp"
#include "tests/support/run_program.hpp"

namespace arbiter::test {

// The same name as another program's type may have, with another size or alignment.
template <std::size_t kVersion>
struct Pose;
template <>
struct Pose<1> {
  double x, y;
};
template <>
struct Pose<2> {
  double x, z;
};
template <char... kLetters>
struct Named {
  int value;
};
struct Twist {
  double linear[3], angular[3];
};
struct SameTwist {
  double linear[3], angular[3];
};
struct NewTwist {
  double linear[3], angular[3], covariance[36];
};
using Pair = std::array<float, 2>;

}  // namespace arbiter::test

ARBITER_TYPE(arbiter::test::Twist, "geometry/Twist");
ARBITER_TYPE(arbiter::test::SameTwist, "geometry/Twist");
ARBITER_TYPE(arbiter::test::NewTwist, "geometry/Twist");
ARBITER_TYPE(arbiter::test::Pair, "Paar \u00e4\u00f6\u00fc");

namespace arbiter::test {
namespace {

// Both orders of opening are tried; both must say the same.
template <class Out, class In>
std::string mismatch(Out open_output, In open_input) {
  std::string said[2];
  for (const bool output_first : {true, false}) {
    Daemon daemon(single_model());
    Node sender("sender");
    Node receiver("receiver");
    const auto look = [&](auto& out) {
      static_cast<void>(out.signal());
      const auto connection = daemon.connection("/out", "/in");
      std::string& result = said[output_first ? 0 : 1];
      if (connection["mismatch"].is_null()) {
        EXPECT_EQ(connection["state"], "connected");
      } else {
        EXPECT_EQ(connection["state"], "mismatch");
        result = connection["mismatch"];
      }
    };
    if (output_first) {
      auto out = open_output(sender);
      auto in = open_input(receiver);
      look(out);
    } else {
      auto in = open_input(receiver);
      auto out = open_output(sender);
      look(out);
    }
  }
  EXPECT_EQ(said[0], said[1]);
  return said[0];
}

template <class T>
auto output() {
  return [](Node& node) { return node.output_port<T>("/out"); };
}
template <class T>
auto input() {
  return [](Node& node) { return node.input_port<T>("/in"); };
}
auto output(const Type& type) {
  return [type](Node& node) { return node.output_port("/out", type); };
}
auto input(const Type& type) {
  return [type](Node& node) { return node.input_port("/in", type); };
}
auto untyped_output() {
  return [](Node& node) { return node.output_port("/out"); };
}
auto untyped_input() {
  return [](Node& node) { return node.input_port("/in"); };
}

TEST(Types, EqualTypesConnect) { EXPECT_EQ(mismatch(output<Number>(), input<Number>()), ""); }

TEST(Types, TypedToUntypedConnects) { EXPECT_EQ(mismatch(output<Number>(), untyped_input()), ""); }

TEST(Types, UntypedToUntypedConnects) {
  EXPECT_EQ(mismatch(untyped_output(), untyped_input()), "");
}

TEST(Types, UntypedToTypedIsRefused) {
  const std::string why = mismatch(untyped_output(), input<Number>());
  EXPECT_NE(why.find("untyped"), std::string::npos) << why;
  EXPECT_NE(why.find("arbiter::test::Number"), std::string::npos) << why;
}

TEST(Types, OtherTypesAreRefusedByName) {
  const std::string why = mismatch(output<Pose<1>>(), input<Pose<2>>());
  EXPECT_NE(why.find("Pose<1"), std::string::npos) << why;
  EXPECT_NE(why.find("Pose<2"), std::string::npos) << why;
}

TEST(Types, NamesThatDifferOnlyFarBehindAreTold) {
  using One = Named<'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a',
                    'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a',
                    'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'b'>;
  using Two = Named<'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a',
                    'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a',
                    'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'a', 'c'>;
  EXPECT_NE(mismatch(output<One>(), input<Two>()), "");
  EXPECT_EQ(mismatch(output<One>(), input<One>()), "");
}

// Another program's idea of the same type, as its segment declares it.
void declare(Daemon& daemon, std::uint64_t size, std::uint64_t alignment,
             const std::string& expected, const std::string& told_to_the_daemon = {},
             const std::string& name = "arbiter::test::Number") {
  Node node("test");
  auto in = node.input_port<Number>("/in");
  shm::TypeInfo type;
  type.set_name(name);
  type.size = size;
  type.alignment = alignment;
  const auto layout = shm::OutputLayout::plan(type, 8);
  const auto segment = shm::make_segment("test", layout.total_size);
  ASSERT_FALSE(shm::allocate(segment, 0, layout.total_size));
  shm::Mapping mapping(segment, layout.total_size, shm::Access::kReadWrite);
  auto& header = *mapping.as<shm::OutputHeader>();
  header.magic = shm::OutputHeader::kMagic;
  header.version = shm::OutputHeader::kVersion;
  header.slot_count = 8;
  header.type = type;
  shm::seal(segment, shm::Seals::kOneWriter);
  RawClient client(daemon.instance());
  client.hello();
  auto open = RawClient::message(wire::MessageKind::kOpenOutput, "/out");
  open.type = type;
  if (!told_to_the_daemon.empty()) open.type.set_name(told_to_the_daemon);
  client.send(open, {segment.get(), -1});
  client.expect(wire::MessageKind::kConnected);
  const std::string why = daemon.connection("/out", "/in")["mismatch"].dump();
  EXPECT_NE(why.find(expected), std::string::npos) << why;
}

TEST(Types, AnotherSizeIsRefused) {
  Daemon daemon(single_model());
  declare(daemon, 16, 8, "sends arbiter::test::Number (16 bytes, aligned to 8), the input port");
}

TEST(Types, AnotherAlignmentIsRefused) {
  Daemon daemon(single_model());
  declare(daemon, 8, 16, "sends arbiter::test::Number (8 bytes, aligned to 16), the input port");
}

TEST(Types, ANameThatIsGivenIsTheTypes) {
  EXPECT_EQ(type_of<Twist>(), Type("geometry/Twist", 48, 8));
  EXPECT_EQ(type_of<const Twist>(), type_of<Twist>());
  EXPECT_EQ(type_of<const volatile Twist>(), type_of<Twist>());
  EXPECT_EQ(type_of<Pair>().name(), "Paar \u00e4\u00f6\u00fc");
  EXPECT_EQ(type_of<Number>(), Type("arbiter::test::Number", 8, 8)) << "as the compiler writes it";
  EXPECT_NE(type_of<Twist>(), type_of<NewTwist>());
  EXPECT_NE(Type("a", 8, 8), Type("b", 8, 8));
  EXPECT_NE(Type("a", 8, 8), Type("a", 8, 4));
}

TEST(Types, TypesOfOneNameAndLayoutConnectWhateverTheProgramsCallThem) {
  EXPECT_EQ(mismatch(output<Twist>(), input<SameTwist>()), "");
  EXPECT_EQ(mismatch(output<Twist>(), input(Type("geometry/Twist", 48, 8))), "");
  EXPECT_EQ(mismatch(output(Type("geometry/Twist", 48, 8)), input<Twist>()), "");
  EXPECT_EQ(mismatch(output(Type("arbiter::test::Number", 8, 8)), input<Number>()), "");
  EXPECT_EQ(mismatch(output(Type("geometry/Twist", 48, 8)), untyped_input()), "");
}

TEST(Types, AMismatchNamesBothTypesAndBothComponents) {
  EXPECT_EQ(mismatch(output<NewTwist>(), input<Twist>()),
            "the output port of \"sender\" sends geometry/Twist (336 bytes, aligned to 8), the "
            "input port of \"receiver\" takes geometry/Twist (48 bytes, aligned to 8)");
  EXPECT_EQ(mismatch(output(Type("Pose", 8, 8)), input(Type("Pose", 8, 4))),
            "the output port of \"sender\" sends Pose (8 bytes, aligned to 8), the input port of "
            "\"receiver\" takes Pose (8 bytes, aligned to 4)");
  EXPECT_EQ(mismatch(untyped_output(), input<Twist>()),
            "the output port of \"sender\" sends untyped samples (up to 4096 bytes), the input "
            "port of \"receiver\" takes geometry/Twist (48 bytes, aligned to 8)");
}

TEST(Types, ARunTimeTypeFeedsATypedPortAndIsFedByOne) {
  Daemon daemon(fan_out_model(2));
  Node node("test");
  const Type type("geometry/Twist", sizeof(Twist), alignof(Twist));
  auto out = node.output_port("/out", type);
  auto typed = node.input_port<Twist>("/in0");
  auto bytes = node.input_port("/in1", type);
  Twist twist{};
  twist.angular[2] = 0.5;
  const auto* data = reinterpret_cast<const std::byte*>(&twist);
  EXPECT_EQ(out.publish(Bytes(data, sizeof twist)).delivered, 2u);
  const auto sample = typed.take();
  ASSERT_TRUE(sample);
  EXPECT_EQ((*sample)->angular[2], 0.5);
  const auto raw = bytes.take();
  ASSERT_TRUE(raw);
  ASSERT_EQ(raw->size(), sizeof twist);
  EXPECT_EQ(std::memcmp(raw->data(), &twist, sizeof twist), 0);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(raw->data()) % alignof(Twist), 0u);
  EXPECT_EQ(out.type(), type);
  EXPECT_EQ(typed.type(), type);
  EXPECT_EQ(bytes.type(), type);
  EXPECT_EQ(sample->type(), type);
  EXPECT_EQ(raw->type(), type);
}

TEST(Types, AScriptFeedsATypedPort) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Twist>("/in");
  const auto pub = [](const std::string& type) {
    return run_program({std::string(ARBITER_PROGRAMS) + "/arbiter", "pub", "/out", "--type", type,
                        "--count", "1"});
  };
  EXPECT_EQ(pub("geometry/Twist:48:8").exit_code, 0);
  const auto sample = in.take();
  ASSERT_TRUE(sample);
  EXPECT_EQ((*sample)->linear[0], 0);
  const auto other = pub("geometry/Twist:40:8");
  EXPECT_NE(other.err.find("sends geometry/Twist (40 bytes, aligned to 8), the input port of "
                           "\"test\" takes geometry/Twist (48 bytes, aligned to 8)"),
            std::string::npos)
      << other.err;
  EXPECT_NE(pub("a\nb:40:8").exit_code, 0);
}

TEST(Types, OfARunTimeTypeEachSampleHasItsSize) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port("/out", Type("Three", 3, 1));
  auto in = node.input_port("/in");
  const std::array<std::byte, 4> bytes{};
  EXPECT_EQ(out.max_size(), 3u);
  EXPECT_THROW(out.publish(Bytes(bytes.data(), 2)), std::invalid_argument);
  EXPECT_THROW(out.publish(Bytes(bytes.data(), 4)), std::invalid_argument);
  EXPECT_FALSE(out.loan(2));
  EXPECT_FALSE(out.loan(4));
  auto loan = out.loan(3);
  ASSERT_TRUE(loan);
  loan->shrink(1);
  EXPECT_THROW(out.publish(std::move(*loan)), std::invalid_argument);
  EXPECT_FALSE(in.take()) << "none of these was an arrival";
  EXPECT_EQ(out.publish(Bytes(bytes.data(), 3)).delivered, 1u);
}

TEST(Types, AVariableTypeHasSamplesOfAnySizeAndOneName) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port("/out", Type::variable("a/msg/B", 16));
  auto in = node.input_port("/in", Type::variable("a/msg/B", 1));
  EXPECT_TRUE(out.type().is_variable());
  EXPECT_FALSE(out.type().has_one_size());
  EXPECT_THROW(out.publish(Bytes(std::array<std::byte, 17>{}.data(), 17)), std::invalid_argument);
  for (const std::size_t size : {0u, 3u, 16u}) {
    const std::array<std::byte, 16> bytes{std::byte{1}, std::byte{2}, std::byte{3}};
    ASSERT_EQ(out.publish(Bytes(bytes.data(), size)).delivered, 1u);
    const auto sample = in.take();
    ASSERT_TRUE(sample);
    EXPECT_EQ(sample->size(), size);
    EXPECT_EQ(std::memcmp(sample->data(), bytes.data(), size), 0);
    EXPECT_EQ(sample->type(), out.type());
  }
  EXPECT_EQ(daemon.source("/out")["type"],
            nlohmann::json({{"name", "a/msg/B"}, {"size", 16}, {"alignment", 0}}));
}

TEST(Types, AVariableTypeIsEqualToNoTypeOfOneSize) {
  Daemon daemon(single_model());
  Node node("test");
  const auto out = node.output_port("/out", Type::variable("T", 8));
  const auto in = node.input_port("/in", Type("T", 8, 8));
  EXPECT_EQ(daemon.connection("/out", "/in")["mismatch"],
            "the output port of \"test\" sends T (of any size), the input port of \"test\" takes T "
            "(8 bytes, aligned to 8)");
  EXPECT_NE(Type::variable("T", 8), Type("T", 8, 8));
  EXPECT_EQ(Type::variable("T", 8), Type::variable("T", 9));
  EXPECT_NE(Type::variable("T", 8), Type::variable("U", 8));
  EXPECT_NE(Type::variable("T", 8), Type::untyped(8));
}

TEST(Types, AnUntypedPortsSamplesSayWhatTheyAre) {
  Daemon daemon(rules(arbiter_at("/in", select("/typed") + select("/bytes", "not /typed"))));
  Node node("test");
  auto in = node.input_port("/in");
  auto typed = node.output_port<Twist>("/typed");
  auto bytes = node.output_port("/bytes", {.max_size = 16});
  EXPECT_TRUE(in.type().is_untyped());
  EXPECT_EQ(bytes.type(), Type::untyped(16));
  const std::array<std::byte, 2> two{};
  bytes.publish(Bytes(two.data(), two.size()));
  {
    const auto sample = in.take();
    ASSERT_TRUE(sample);
    EXPECT_TRUE(sample->type().is_untyped());
    EXPECT_EQ(sample->size(), 2u);
  }
  typed.publish(Twist());
  const auto sample = in.take();
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->type(), type_of<Twist>());
  EXPECT_EQ(sample->type().name(), "geometry/Twist");
}

// A receiver judges what the publisher's memory says, whatever the daemon was told.
TEST(Types, AReceiverBelievesTheMemoryThatItReads) {
  Daemon daemon(single_model());
  declare(daemon, 8, 8, "the output port sends Other (8 bytes, aligned to 8), the input port takes",
          "arbiter::test::Number", "Other");
}
TEST(Types, AReceiverTakesNothingOfATypeWhoseNameWouldMislead) {
  Daemon daemon(single_model());
  declare(daemon, 8, 8, "the output port's type is not one: its name has a control character",
          "arbiter::test::Number", "arbiter::test::Number\x1b");
}

}  // namespace
}  // namespace arbiter::test
