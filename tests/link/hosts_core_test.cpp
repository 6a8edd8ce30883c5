// Rule 8 of docs/hosts.md, by injected time: what links say of their hosts (cards), and who is
// there (256 hosts; 5 min after they are gone).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "link/core/host_card.hpp"
#include "link/core/neighbours.hpp"
#include "tests/link/host_cards.hpp"
#include "tests/link/messages_and_times.hpp"

namespace arbiter::test {
namespace {

using namespace link;
using testing::ElementsAre;
using testing::IsEmpty;

static_assert(Neighbours::kRemembered == 300 * kS, "rule 8 says so");
static_assert(Neighbours::kMost == 256, "rule 9 says so");
static_assert(Neighbours::kMostNames == 65'536, "docs/hosts.md says so");

TEST(HostCard, IsReadAsItWasWritten) {
  const HostCard card = host_card("head", 5, {"/a:i", "/b:i"}, {"/c:o"});
  EXPECT_EQ(read_host_card(as_bytes(write_host_card(card))), card);
}

TEST(HostCard, IsRefusedWhereItIsCutAnywhere) {
  const ByteString whole = write_host_card(host_card("head", 5, {"/a:i"}, {"/c:o"}));
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(read_host_card(Bytes(whole.data(), size))) << size;
  }
}

TEST(HostCard, IsRefusedWhereItsNamesAreNone) {
  const auto is_read = [](const HostCard& card) {
    return read_host_card(as_bytes(write_host_card(card))).has_value();
  };
  EXPECT_TRUE(is_read(host_card("head", 5)));
  EXPECT_FALSE(is_read(host_card("he ad", 5)));
  EXPECT_FALSE(is_read(host_card("head", 0)));
  EXPECT_FALSE(is_read(host_card("head", 5, {"a"})));
  EXPECT_FALSE(is_read(host_card("head", 5, {"/b", "/a"}))) << "in order";
  EXPECT_FALSE(is_read(host_card("head", 5, {"/a", "/a"}))) << "each once";
  HostCard card = host_card("head", 5);
  card.model = "a\nb";
  EXPECT_FALSE(is_read(card));
  card = host_card("head", 5);
  card.instance = ".x";
  EXPECT_FALSE(is_read(card));
}

TEST(HostCard, OfAnotherVersionIsKnownToBeOne) {
  const HostCard card = host_card("head", 7);
  ByteString bytes = write_host_card(card);
  EXPECT_FALSE(is_of_other_version(as_bytes(bytes)));
  bytes[4] = std::byte{kCardVersion + 1};
  EXPECT_FALSE(read_host_card(as_bytes(bytes)));
  EXPECT_TRUE(is_of_other_version(as_bytes(bytes)));
  bytes[0] = std::byte{0};
  EXPECT_FALSE(is_of_other_version(as_bytes(bytes))) << "nonsense";
}

TEST(HostCard, LeavesOutNamesForWhichThereIsNoRoom) {
  std::vector<std::string> ports;
  for (int i = 0; i < 2000; ++i) {
    ports.push_back("/" + std::to_string(10'000 + i) + std::string(200, 'x'));
  }
  const ByteString bytes = write_host_card(host_card("head", 5, ports, {"/c:o"}));
  EXPECT_LE(bytes.size(), kMaxCardBytes);
  const auto card = read_host_card(as_bytes(bytes));
  ASSERT_TRUE(card);
  EXPECT_EQ(card->input_count, 2000U);
  EXPECT_LT(card->inputs.size(), 2000U);
  EXPECT_FALSE(card->names_all());
  EXPECT_THAT(card->outputs, ElementsAre("/c:o"));
}

TEST(ModelDigest, DiffersWhereTextsDo) {
  const auto of = [](const std::vector<std::string>& texts) {
    Digest digest;
    for (const std::string& text : texts) digest.add(text);
    return digest.value();
  };
  EXPECT_EQ(of({"a", "b"}), of({"a", "b"}));
  EXPECT_NE(of({"a", "b"}), of({"ab"}));
  EXPECT_NE(of({"a"}), of({"a", ""}));
  EXPECT_EQ(hexadecimal(0x1fU), "000000000000001f");
}

// Each may have a card of thousands, and all are kept and compared.
TEST(NeighbouringHosts, ThatNameTheMostPortsLoseThemWhereAllAreTooMany) {
  std::vector<std::string> many;
  for (std::size_t i = 0; i < kMaxPortsOfCard; ++i)
    many.push_back("/" + std::to_string(10'000 + i));
  Neighbours neighbours;
  neighbours.note(1, host_card("head", 1, {"/a:i"}, {"/b:o"}), kS);
  constexpr std::size_t kFitting = Neighbours::kMostNames / kMaxPortsOfCard;
  for (std::size_t i = 0; i <= kFitting; ++i) {
    neighbours.note(2 + i, host_card("crowd" + std::to_string(i), 2 + i, {}, many), kS);
  }
  std::size_t names = 0;
  for (const Neighbour& each : neighbours.all()) {
    names += each.card->inputs.size() + each.card->outputs.size();
    const bool is_head = each.card->host == "head";
    EXPECT_EQ(each.card->output_count, is_head ? 1U : kMaxPortsOfCard)
        << "it has them all the same";
    if (is_head) EXPECT_TRUE(each.card->names_all());
  }
  EXPECT_EQ(neighbours.all().size(), kFitting + 2);
  EXPECT_LE(names, Neighbours::kMostNames);
  EXPECT_GT(names, Neighbours::kMostNames - 2 * kMaxPortsOfCard) << "no more than have to";
}

// Whose cards have become longer since they came.
TEST(NeighbouringHosts, ThatNameMorePortsThanBeforeLoseThem) {
  std::vector<std::string> many;
  for (std::size_t i = 0; i < kMaxPortsOfCard; ++i)
    many.push_back("/" + std::to_string(10'000 + i));
  Neighbours neighbours;
  constexpr std::size_t kMoreThanFit = Neighbours::kMostNames / kMaxPortsOfCard + 1;
  for (const auto& outputs : {std::vector<std::string>{"/b:o"}, many}) {
    for (std::size_t i = 0; i < kMoreThanFit; ++i) {
      neighbours.note(1 + i, host_card("crowd" + std::to_string(i), 1 + i, {}, outputs), kS);
    }
  }
  std::size_t names = 0;
  for (const Neighbour& each : neighbours.all()) names += each.card->outputs.size();
  EXPECT_EQ(neighbours.all().size(), kMoreThanFit);
  EXPECT_LE(names, Neighbours::kMostNames);
}

std::vector<std::string> names_of(const Neighbours& neighbours) {
  std::vector<std::string> names;
  for (const Neighbour& each : neighbours.all()) {
    names.push_back(each.card->host + (each.is_up ? "" : " gone"));
  }
  return names;
}

TEST(NeighbouringHosts, AreGoneWithTheirWritersAndListedForSomeMinutes) {
  Neighbours neighbours;
  neighbours.note(1, host_card("rear", 11), kS);
  neighbours.note(2, host_card("head", 12), kS);
  neighbours.keep({1, 2}, 2 * kS);
  EXPECT_THAT(names_of(neighbours), ElementsAre("head", "rear"));
  neighbours.keep({1}, 3 * kS);
  EXPECT_THAT(names_of(neighbours), ElementsAre("rear", "head gone"));
  EXPECT_EQ(neighbours.all().back().since, 3 * kS);
  neighbours.keep({1}, 3 * kS + Neighbours::kRemembered - 1);
  EXPECT_THAT(names_of(neighbours), ElementsAre("rear", "head gone"));
  neighbours.keep({1}, 3 * kS + Neighbours::kRemembered);
  EXPECT_THAT(names_of(neighbours), ElementsAre("rear"));
}

TEST(NeighbouringHosts, ThatAreStartedAgainAreNotListedAsGone) {
  Neighbours neighbours;
  neighbours.note(1, host_card("head", 11), kS);
  neighbours.note(2, host_card("head", 12), 2 * kS);  // its earlier life has a lease
  EXPECT_THAT(names_of(neighbours), ElementsAre("head", "head"));
  neighbours.keep({2}, 3 * kS);
  EXPECT_THAT(names_of(neighbours), ElementsAre("head"));
  neighbours.keep({}, 4 * kS);
  EXPECT_THAT(names_of(neighbours), ElementsAre("head gone"));
  neighbours.note(3, host_card("head", 12), 5 * kS);  // the cable is back
  EXPECT_THAT(names_of(neighbours), ElementsAre("head"));
}

// The writers are asked for without a lock: one may be matched, and heard, once they are counted.
TEST(NeighbouringHosts, ThatAreHeardWhileWritersAreCountedAreNotGone) {
  Neighbours neighbours;
  neighbours.note(1, host_card("head", 11), 2 * kS);
  neighbours.keep({}, kS);
  EXPECT_THAT(names_of(neighbours), ElementsAre("head"));
  neighbours.keep({1}, 3 * kS);
  neighbours.note(1, host_card("head", 11), 5 * kS);  // another card of the same writer
  neighbours.keep({}, 4 * kS);
  EXPECT_THAT(names_of(neighbours), ElementsAre("head"));
  neighbours.keep({}, 6 * kS);
  EXPECT_THAT(names_of(neighbours), ElementsAre("head gone"));
}

// A key is the transport's, and means nothing once its writer is gone: another may get it.
TEST(NeighbouringHosts, ThatAreGoneAreNotKnownByTheirWritersAnyMore) {
  Neighbours neighbours;
  neighbours.note(1, host_card("head", 11), kS);
  neighbours.keep({}, 2 * kS);
  neighbours.note(1, host_card("rear", 12), 3 * kS);
  EXPECT_THAT(names_of(neighbours), ElementsAre("rear", "head gone"));
}

TEST(NeighbouringHosts, AreBoundedInNumberAndThoseThatAreGoneGiveWay) {
  Neighbours neighbours;
  std::vector<std::uint64_t> keys;
  for (std::uint64_t key = 1; key <= Neighbours::kMost; ++key) {
    EXPECT_TRUE(neighbours.note(key, host_card("host" + std::to_string(key), key), kS));
    keys.push_back(key);
  }
  EXPECT_FALSE(neighbours.note(999, host_card("more", 999), kS));
  keys.pop_back();
  neighbours.keep(keys, 2 * kS);
  EXPECT_TRUE(neighbours.note(999, host_card("more", 999), 2 * kS));
  EXPECT_EQ(neighbours.all().size(), Neighbours::kMost);
}

// As many as there are places for. Returns their keys.
std::vector<std::uint64_t> fill(Neighbours& neighbours) {
  std::vector<std::uint64_t> keys;
  for (std::uint64_t key = 1; key <= Neighbours::kMost; ++key) {
    neighbours.note(key, host_card("host" + std::to_string(key), key), kS);
    keys.push_back(key);
  }
  return keys;
}

// How long its writer is believed to be there, each host has said itself.
TEST(NeighbouringHosts, ThatDoNotPulseAreGoneAndMissedForSomeMinutesOnly) {
  Neighbours neighbours;
  std::vector<std::uint64_t> there = fill(neighbours);  // of one participant
  const Participant pulsing = participant(2);
  EXPECT_FALSE(neighbours.note(999, host_card("more", 999), kS));
  EXPECT_FALSE(neighbours.note(1000, host_card("well", 1000), kS, pulsing));
  there.insert(there.end(), {999, 1000});
  neighbours.keep(there, kS + Neighbours::kUnheard);
  EXPECT_TRUE(neighbours.all().front().is_up) << "it is not known who pulses";
  neighbours.keep(there, kS + Neighbours::kUnheard - 1, std::set{pulsing});
  EXPECT_TRUE(neighbours.all().front().is_up) << "pulses may come later";
  neighbours.keep(there, kS + Neighbours::kUnheard, std::set{pulsing});
  EXPECT_FALSE(neighbours.all().front().is_up);
  neighbours.keep(there, kS + Neighbours::kUnheard + Neighbours::kRemembered, std::set{pulsing});
  EXPECT_TRUE(neighbours.all().empty());
  EXPECT_EQ(neighbours.without_place(), 1U) << "that one is there";
}

// Whoever has all hosts switch would pass over them.
TEST(NeighbouringHosts, ThatFindNoPlaceAreCountedWhileTheyAreThereAndForSomeMinutes) {
  Neighbours neighbours;
  std::vector<std::uint64_t> keys = fill(neighbours);
  EXPECT_EQ(neighbours.without_place(), 0U);
  EXPECT_FALSE(neighbours.note(999, host_card("more", 999), 2 * kS));
  EXPECT_FALSE(neighbours.note(999, host_card("more", 999), 2 * kS));
  EXPECT_EQ(neighbours.without_place(), 1U) << "each once";
  keys.push_back(999);
  neighbours.keep(keys, 3 * kS);
  EXPECT_EQ(neighbours.without_place(), 1U);
  keys.pop_back();
  neighbours.keep(keys, 4 * kS);
  neighbours.keep(keys, 4 * kS + Neighbours::kRemembered - 1);
  EXPECT_EQ(neighbours.without_place(), 1U) << "it is gone, and may come back";
  neighbours.keep(keys, 4 * kS + Neighbours::kRemembered);
  EXPECT_EQ(neighbours.without_place(), 0U);
}

TEST(NeighbouringHosts, ThatFindAPlaceLaterAreCountedNoMore) {
  Neighbours neighbours;
  std::vector<std::uint64_t> keys = fill(neighbours);
  EXPECT_FALSE(neighbours.note(999, host_card("more", 999), 2 * kS));
  keys.back() = 999;
  neighbours.keep(keys, 3 * kS);
  EXPECT_TRUE(neighbours.note(999, host_card("more", 999), 4 * kS));
  EXPECT_EQ(neighbours.without_place(), 1U) << "who gave way to it is missed";
  EXPECT_FALSE(neighbours.note(256, host_card("host256", 256), 5 * kS));
  EXPECT_EQ(neighbours.without_place(), 1U) << "it is the same host";
  keys.push_back(256);
  keys.front() = keys.back();
  neighbours.keep(keys, 6 * kS);
  EXPECT_TRUE(neighbours.note(256, host_card("host256", 256), 7 * kS));
  neighbours.note(1, host_card("host1", 1000), 8 * kS);
  EXPECT_EQ(neighbours.without_place(), 1U);
}

TEST(NeighbouringHosts, ThatAreGoneForTheLongestTimeGiveWayAndAreMissed) {
  Neighbours neighbours;
  std::vector<std::uint64_t> keys = fill(neighbours);
  keys.pop_back();
  neighbours.keep(keys, 2 * kS);  // host256
  keys.erase(keys.begin());
  neighbours.keep(keys, 3 * kS);  // host1
  EXPECT_TRUE(neighbours.note(999, host_card("more", 999), 4 * kS));
  EXPECT_THAT(names_of(neighbours), testing::Contains("host1 gone"));
  EXPECT_THAT(names_of(neighbours), testing::Not(testing::Contains("host256 gone")));
  EXPECT_EQ(neighbours.without_place(), 1U);
  keys.push_back(999);
  neighbours.keep(keys, 2 * kS + Neighbours::kRemembered);
  EXPECT_EQ(neighbours.without_place(), 0U) << "nobody would miss it any more";
}

TEST(NeighbouringHosts, WithoutAPlaceAreBoundedInNumber) {
  Neighbours neighbours;
  fill(neighbours);
  constexpr std::uint64_t kMany = 1000 + 2 * Neighbours::kMostWithoutPlace;
  for (std::uint64_t key = 1000; key < kMany; ++key) {
    neighbours.note(key, host_card("more" + std::to_string(key), key), 2 * kS);
  }
  EXPECT_EQ(neighbours.without_place(), Neighbours::kMostWithoutPlace);
}

}  // namespace
}  // namespace arbiter::test
