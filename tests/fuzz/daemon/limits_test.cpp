// What those who hang up cost the daemon: what it keeps for those who live is bounded as what it
// has for those who are here, and that they have gone it hears once. On the fuzz target's stage,
// where thousands of processes cost nothing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <string>
#include <vector>

#include "tests/fuzz/daemon/stage.hpp"
#include "tests/support/raw_port.hpp"

namespace arbiter::fuzz {
namespace {

using wire::MessageKind;

wire::Message message(MessageKind kind, const std::string& name) {
  wire::Message result;
  result.kind = kind;
  result.value = wire::kWireVersion;
  result.flags = wire::kComesBack;
  result.set_name(name);
  return result;
}

// As arbiterd does at its start.
void allow_as_many_descriptors_as_may_be() {
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &limit), 0);
  limit.rlim_cur = limit.rlim_max;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &limit), 0);
}

// Why a newcomer of that process is not welcome; empty if it is.
std::string refusal(Stage& stage, const Process& process) {
  const Connection connection(stage.path(), process);
  stage.run();
  connection.send(message(MessageKind::kHello, "newcomer"));
  stage.run();
  wire::Received received;
  EXPECT_EQ(wire::receive_message(connection.socket(), received, false),
            wire::ReceiveResult::kReceived);
  return std::string(received.message.text_view());
}

TEST(Absentees, CountAmongTheClientsOfTheirUser) {
  allow_as_many_descriptors_as_may_be();
  Stage stage;
  const Process process(1 << 23, 4'000'000);
  const Process another(1 << 23, 4'000'001);
  const auto segment = make_input_segment(1);
  const auto samples = test::raw_output_segment();
  const shm::Bell bell;
  // A sixteenth is kept for root and the daemon's user; of the rest he may have half.
  constexpr std::uint32_t kMost = (shm::kMaxClients - shm::kMaxClients / 16) / 2;
  for (std::uint32_t i = 0; i < kMost; ++i) {
    const Connection connection(stage.path(), process);
    stage.run();
    connection.send(message(MessageKind::kHello, "away"));
    // Of both kinds, for his share of names is no larger than that of clients.
    const std::string name = "/away/" + std::to_string(i);
    if (i % 2 == 0) {
      connection.send(message(MessageKind::kOpenInput, name),
                      {segment.get(), bell.write_end().get()});
    } else {
      connection.send(message(MessageKind::kOpenOutput, name), {samples.get()});
    }
    stage.run();
    if (i + 2 == kMost) {
      EXPECT_EQ(refusal(stage, process), "");
    }
  }
  stage.run();
  EXPECT_THAT(refusal(stage, process), testing::HasSubstr("kMaxClients"));
  EXPECT_EQ(refusal(stage, another), "");
}

// The kernel says of each that it has hung up, whatever is asked for, until it is closed.
TEST(HungUp, ManyAtOnceAreNotHeardAgainWhileTheyWaitForTheirTurn) {
  allow_as_many_descriptors_as_may_be();
  Stage stage;
  const Process process(1 << 23, 4'000'000);
  constexpr int kMany = 200;
  std::vector<Connection> many;
  for (int i = 0; i < kMany; ++i) {
    many.emplace_back(stage.path(), process);
    stage.run();
    many.back().send(message(MessageKind::kHello, "many"));
    stage.run();
  }
  many.clear();
  Loop::heard = 0;
  stage.run();
  EXPECT_GE(Loop::heard, kMany);
  EXPECT_LE(Loop::heard, 3 * kMany);
}

}  // namespace
}  // namespace arbiter::fuzz
