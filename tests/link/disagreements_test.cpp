// Rules 1 and 6 of docs/hosts.md, by injected time: what hosts do not agree upon (after 1.5 s; one
// name of two machines after 3 s).
#include "link/core/disagreements.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/link/host_cards.hpp"
#include "tests/link/messages_and_times.hpp"

namespace arbiter::test {
namespace {

using namespace link;
using testing::ElementsAre;
using testing::IsEmpty;

static_assert(Disagreements::kSettles == 1500 * kMs, "rule 1 says so");
static_assert(Disagreements::kNoEarlierLife == 3 * kS, "rule 6 says so");

// Returns what stands once it has settled.
std::vector<std::string> texts_of(const std::vector<HostCard>& cards,
                                  std::vector<shm::Nanoseconds> since = {}) {
  since.resize(cards.size());
  std::vector<PresentHost> hosts;
  for (std::size_t i = 0; i < cards.size(); ++i) hosts.push_back({&cards[i], since[i]});
  Disagreements disagreements;
  const shm::Nanoseconds begin = 10 * kS;
  EXPECT_THAT(disagreements.look(hosts, begin), IsEmpty()) << "a port may be on its way";
  std::vector<std::string> texts;
  for (const Disagreement& each : disagreements.look(hosts, begin + Disagreements::kSettles)) {
    texts.push_back((each.is_error() ? "error: " : "warning: ") + each.text());
  }
  EXPECT_THAT(disagreements.look(hosts, begin + 2 * Disagreements::kSettles), IsEmpty())
      << "each is news once";
  return texts;
}

TEST(HostDisagreement, IsAnInputPortThatIsOpenOnTwo) {
  EXPECT_THAT(texts_of({host_card("rear", 1, {"/m:i", "/r:i"}), host_card("base", 2, {"/m:i"})}),
              ElementsAre("error: the input port /m:i is open on the hosts base and rear, and each "
                          "decides it for itself: close it on all but one"));
}

TEST(HostDisagreement, IsASourceThatIsOpenOnSeveral) {
  EXPECT_THAT(texts_of({host_card("c", 1, {}, {"/s"}), host_card("b", 2, {}, {"/s"}),
                        host_card("a", 3, {}, {"/s"})}),
              ElementsAre("warning: the source /s is open on the hosts a, b and c: each of them "
                          "obeys its own"));
}

TEST(HostDisagreement, IsADifferentModel) {
  HostCard other = host_card("base", 2);
  other.digest = 8;
  EXPECT_THAT(texts_of({host_card("head", 1), other}),
              ElementsAre("warning: the models of the hosts base and head are not all the same"));
  other.digest = 0;  // not known, or none is in force
  EXPECT_THAT(texts_of({host_card("head", 1), other}), IsEmpty());
}

TEST(HostDisagreement, IsANameOfTwoMachinesButNotOfALinkThatWasStartedAgain) {
  const std::vector<HostCard> cards{host_card("head", 1, {"/p"}), host_card("head", 2, {"/p"})};
  EXPECT_THAT(texts_of(cards, {kS, 9 * kS}), IsEmpty()) << "a lease has not run out";
  EXPECT_THAT(
      texts_of(cards, {kS, 2 * kS}),
      ElementsAre(testing::HasSubstr("the input port /p is open on the hosts head and head"),
                  "warning: several machines are called head: give each its own --host"));
}

TEST(HostDisagreement, IsNewsAgainWhenItHasBeenSettled) {
  const HostCard base = host_card("base", 1, {"/p"});
  const HostCard head = host_card("head", 2, {"/p"});
  Disagreements disagreements;
  const std::vector<PresentHost> both{{&base, 0}, {&head, 0}};
  disagreements.look(both, 10 * kS);
  EXPECT_EQ(disagreements.look(both, 12 * kS).size(), 1U);
  EXPECT_EQ(disagreements.standing().size(), 1U);
  EXPECT_THAT(disagreements.look({{&base, 0}}, 13 * kS), IsEmpty());
  EXPECT_THAT(disagreements.standing(), IsEmpty());
  disagreements.look(both, 14 * kS);
  EXPECT_EQ(disagreements.look(both, 16 * kS).size(), 1U);
}

TEST(HostDisagreement, GoesOnForTheOthersWhenOneJoinsOrLeaves) {
  const HostCard a = host_card("a", 1, {"/p"});
  const HostCard b = host_card("b", 2, {"/p"});
  const HostCard c = host_card("c", 3, {"/p"});
  Disagreements disagreements;
  const std::vector<PresentHost> two{{&a, 0}, {&b, 0}};
  const std::vector<PresentHost> three{{&a, 0}, {&b, 0}, {&c, 0}};
  disagreements.look(two, 10 * kS);
  EXPECT_THAT(disagreements.look(three, 11 * kS), IsEmpty());
  EXPECT_EQ(disagreements.look(two, 12 * kS).size(), 1U) << "though they were three meanwhile";
  for (int i = 0; i < 5; ++i) {  // its component is started again and again
    EXPECT_THAT(disagreements.look(three, (13 + 2 * i) * kS), IsEmpty());
    EXPECT_EQ(disagreements.standing().size(), 1U);
    EXPECT_EQ(disagreements.standing().front().hosts.size(), 3U);
    EXPECT_THAT(disagreements.look(two, (14 + 2 * i) * kS), IsEmpty());
    EXPECT_EQ(disagreements.standing().size(), 1U);
  }
  disagreements.look(three, 30 * kS);
  EXPECT_EQ(disagreements.look(three, 32 * kS).size(), 1U) << "of these it is news";
  // The others have nothing to do with it.
  const HostCard d = host_card("d", 4, {"/p"});
  EXPECT_THAT(disagreements.look({{&c, 0}, {&d, 0}}, 33 * kS), IsEmpty());
  EXPECT_THAT(disagreements.standing(), IsEmpty());
}

TEST(HostDisagreement, IsBoundedInNumber) {
  std::vector<std::string> ports;
  for (int i = 0; i < 1000; ++i) ports.push_back("/" + std::to_string(10'000 + i));
  EXPECT_EQ(texts_of({host_card("a", 1, ports), host_card("b", 2, ports)}).size(),
            Disagreements::kMost);
}

}  // namespace
}  // namespace arbiter::test
