// What a link knows and is asked while it has not joined its network, or does not know all that are
// there: link/desk.hpp.
#include "link/desk.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/sockios.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <memory>
#include <string>

#include "link/say_sparingly.hpp"
#include "shm/clock.hpp"
#include "tests/cli/arbiter_program.hpp"
#include "tests/link/scene.hpp"
#include "wire/hosts.hpp"
#include "wire/link_call.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

link::HostCard card_of(const std::string& host, link::Incarnation incarnation) {
  link::HostCard card;
  card.host = host;
  card.instance = host;
  card.version = "1.2";
  card.incarnation = incarnation;
  return card;
}

// Of a link that waits for its daemon, or for its network.
class DeskWithoutANetwork : public testing::Test {
 protected:
  const TemporaryDirectory runtime_;
  const ScopedVariable directory_{"RUNTIME_DIRECTORY", runtime_.path()};
};

TEST_F(DeskWithoutANetwork, ForgetsWhoHasBeenGoneForLong) {
  const shm::Nanoseconds now = shm::monotonic_now();
  const shm::Nanoseconds long_ago = now - link::Neighbours::kRemembered;
  link::Neighbours known;
  known.note(1, card_of("head", 11), long_ago - 1);
  known.note(2, card_of("rear", 12), long_ago - 1);
  known.keep({2}, long_ago);
  known.keep({}, now - 1);
  ASSERT_EQ(known.all().size(), 2U);
  link::Desk desk(card_of("base", 1), known);
  desk.look({});
  const link::Neighbours left = desk.known();
  ASSERT_EQ(left.all().size(), 1U);
  EXPECT_EQ(left.all()[0].card->host, "rear");
}

// It would go ahead alone, and say that all have switched.
TEST_F(DeskWithoutANetwork, DoesNotSwitchAllHosts) {
  link::Desk desk(card_of("base", 1), {});
  link::OwnHost own;
  own.waits_for = "eth0 is down";
  desk.look(own);
  const auto result = arbiter({"switch", "rest", "--all", "--instance", "base"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, IsEmpty());
  EXPECT_THAT(result.err, HasSubstr("this link has not joined its network yet, and does not know "
                                    "the other hosts: eth0 is down"));
}

TEST_F(DeskWithoutANetwork, AnswersForItsOwnHost) {
  link::Desk desk(card_of("base", 1), {});
  desk.answers().add("where", "observe", [](const link::Question&) {
    return link::Answer{false, "here"};
  });
  desk.look({});
  wire::LinkCall link("base");
  const auto answers = link.ask_hosts({wire::kAllHosts, "where"});
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(answers[0].text, "here");
  const auto result = arbiter({"status", "--all", "--instance", "base"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("the link has not joined its network yet"));
}

// The question waits until all hosts have been heard that there may be.
TEST_F(DeskWithoutANetwork, EndsWithoutWaitingForAnOpenQuestion) {
  const OwnDomain domain;
  const gateway::Bell bell;
  const link::Network network({domain.number(), {}, {}});
  auto desk = std::make_unique<link::Desk>(card_of("base", 1), link::Neighbours());
  desk->look({});
  std::string why_not;
  const auto program = wire::connect_to_link("base", why_not);
  ASSERT_TRUE(program) << why_not;
  desk->join(network, "lo", bell);
  const std::string question =
      wire::write_link_question({wire::kAllHosts, wire::kPrepareVerb, "rest"});
  ASSERT_GT(::send(program->get(), question.data(), question.size(), MSG_NOSIGNAL), 0);
  await([&] {
    int unread = 0;
    return ::ioctl(program->get(), SIOCOUTQ, &unread) == 0 && unread == 0;
  });
  desk.reset();
  std::string answer(wire::kMaxLinkPacket, '\0');
  answer.resize(static_cast<std::size_t>(
      std::max<ssize_t>(::recv(program->get(), answer.data(), answer.size(), 0), 0)));
  EXPECT_EQ(answer, "the link ends");
}

// Where many sources come and go at once, for example.
TEST(WhatIsSaidSparingly, LeavesRoomForWhatIsWrong) {
  using gateway::Level;
  for (int i = 0; i < 200; ++i) {
    if (!link::say_sparingly(Level::kInfo, "a source comes from another host")) break;
    ASSERT_LT(i, 150);
  }
  EXPECT_TRUE(link::say_sooner_or_later(Level::kError, "a port is open on several hosts"));
}

class DeskWithTooManyHosts : public DeskWithoutANetwork {};

// One more than there are places for: it would be passed over.
TEST_F(DeskWithTooManyHosts, DoesNotSwitchAll) {
  const shm::Nanoseconds now = shm::monotonic_now();
  link::Neighbours known;
  for (std::uint64_t key = 1; key <= link::Neighbours::kMost + 1; ++key) {
    known.note(key, card_of("host" + std::to_string(key), key), now);
  }
  const OwnDomain domain;
  const gateway::Bell bell;
  const link::Network network({domain.number(), {}, {}});
  link::Desk desk(card_of("base", 1), known);
  desk.join(network, "lo", bell);
  desk.look({});
  const std::string what =
      "there is no place in the link's list for 1 of the hosts that were heard, which cannot be";
  const auto result = arbiter({"switch", "rest", "--all", "--instance", "base"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, IsEmpty());
  EXPECT_THAT(result.err, HasSubstr(what));
  const auto hosts = wire::read_hosts(wire::LinkCall("base").ask({"", "hosts"}));
  EXPECT_EQ(hosts.hosts.size(), 1 + link::Neighbours::kMost);
  EXPECT_EQ(hosts.without_place, 1U);
  desk.close();
}

}  // namespace
}  // namespace arbiter::test
