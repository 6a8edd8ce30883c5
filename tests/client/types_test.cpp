// What a port carries: type name, size and alignment are checked at both ends.
#include <gtest/gtest.h>

#include <arbiter/arbiter.hpp>

#include "shm/output_segment.hpp"
#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"

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
             const std::string& expected) {
  Node node("test");
  auto in = node.input_port<Number>("/in");
  shm::TypeInfo type;
  type.set_name("arbiter::test::Number");
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
  auto open = RawClient::message(shm::MessageKind::kOpenOutput, "/out");
  open.type = type;
  client.send(open, {segment.get(), -1});
  client.expect(shm::MessageKind::kConnected);
  const std::string why = daemon.connection("/out", "/in")["mismatch"].dump();
  EXPECT_NE(why.find(expected), std::string::npos) << why;
}

TEST(Types, AnotherSizeIsRefused) {
  Daemon daemon(single_model());
  declare(daemon, 16, 8, "has 16 bytes at the output port and 8 at the input port");
}

TEST(Types, AnotherAlignmentIsRefused) {
  Daemon daemon(single_model());
  declare(daemon, 8, 16, "is aligned to 16 bytes at the output port and to 8 at the input port");
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
