// Who offers a source, of those whose offers stand: not whoever has ended unheard.
#include "link/core/offers.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace arbiter::link {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr shm::Nanoseconds kOneSecond = 1'000'000'000;
constexpr const char* kImage = "/Camera/image:o";

Offer offer(std::uint64_t key, const std::string& host, Incarnation incarnation,
            std::uint8_t participant) {
  OfferCard card;
  card.host = host;
  card.source = kImage;
  card.incarnation = incarnation;
  return {key, card, {participant}};
}

OtherLinks with_card(std::uint8_t participant, std::vector<std::string> outputs,
                     std::uint32_t more = 0) {
  auto card = std::make_shared<HostCard>();
  card->output_count = static_cast<std::uint32_t>(outputs.size()) + more;
  card->outputs = std::move(outputs);
  return {{}, {{Participant{participant}, std::move(card)}}};
}

TEST(Offers, AreOfOneSource) {
  Offers offers("/Other/image:o");
  offers.look({offer(1, "head", 11, 1)}, {}, kOneSecond);
  EXPECT_EQ(offers.speaker(), nullptr);
}

TEST(Offers, OfADeafHostDoNotCount) {
  Offers offers(kImage);
  offers.look({offer(1, "head", 11, 1)}, {}, kOneSecond);
  ASSERT_NE(offers.speaker(), nullptr);
  EXPECT_EQ(offers.speaker()->card.host, "head");
  offers.look({offer(1, "head", 11, 1)}, {{Participant{1}}, {}}, kOneSecond);
  EXPECT_EQ(offers.speaker(), nullptr);
  EXPECT_THAT(offers.hosts(), IsEmpty());
}

// In whatever order the transport names them, and though the newest one ends.
TEST(Offers, OfOneParticipantTheNewestAloneIsTrue) {
  const Offer before = offer(1, "head", 11, 1);
  const Offer now = offer(2, "head", 12, 1);
  for (const auto& both : {std::vector{before, now}, std::vector{now, before}}) {
    Offers offers(kImage);
    offers.look(both, {}, kOneSecond);
    ASSERT_NE(offers.speaker(), nullptr);
    EXPECT_EQ(offers.speaker()->key, 2U);
    offers.look(both, {}, kOneSecond + Offers::kNoEarlierLife);
    EXPECT_EQ(offers.shared_name(), "");
    offers.look({before}, {}, kOneSecond + Offers::kNoEarlierLife);
    EXPECT_EQ(offers.speaker(), nullptr);
  }
}

TEST(Offers, CountOnFromTheLargestNumber) {
  Offers offers(kImage);
  offers.look({offer(1, "head", ~Incarnation{0}, 1), offer(2, "head", 1, 1)}, {}, kOneSecond);
  ASSERT_NE(offers.speaker(), nullptr);
  EXPECT_EQ(offers.speaker()->key, 2U);
}

TEST(Offers, OfAHostThatDoesNotNameTheSourceForLongAreOver) {
  Offers offers(kImage);
  const std::vector<Offer> both{offer(1, "head", 11, 1), offer(2, "rear", 22, 2)};
  const OtherLinks others = with_card(1, {"/A/a:o", "/Z/z:o"});
  offers.look(both, others, kOneSecond);
  offers.look(both, others, kOneSecond + Offers::kUnnamed - 1);
  EXPECT_EQ(offers.speaker()->card.host, "head") << "its card may come later";
  offers.look(both, others, kOneSecond + Offers::kUnnamed);
  EXPECT_EQ(offers.speaker()->card.host, "rear");
  EXPECT_THAT(offers.hosts(), ElementsAre("rear"));
  offers.look(both, with_card(1, {"/A/a:o", kImage}), 5 * kOneSecond);
  EXPECT_THAT(offers.hosts(), ElementsAre("head", "rear"));
  EXPECT_EQ(offers.speaker()->card.host, "rear") << "whoever comes meanwhile";
}

TEST(Offers, OfAHostWithMorePortsThanItCanNameStand) {
  Offers offers(kImage);
  for (const shm::Nanoseconds now : {kOneSecond, 9 * kOneSecond}) {
    offers.look({offer(1, "head", 11, 1)}, with_card(1, {"/A/a:o"}, 1), now);
    EXPECT_NE(offers.speaker(), nullptr);
  }
}

// Its lease is what it says itself: it may be gone.
TEST(Offers, OfAHostThatDoesNotPulseAreOver) {
  Offers offers(kImage);
  const std::vector<Offer> both{offer(1, "far", 11, 1), offer(2, "head", 22, 2)};
  OtherLinks others;
  others.pulsing = {Participant{2}};
  offers.look({both[0]}, others, kOneSecond);
  offers.look(both, others, kOneSecond + Offers::kUnnamed - 1);
  EXPECT_EQ(offers.speaker()->card.host, "far") << "its pulses may come later";
  offers.look(both, others, kOneSecond + Offers::kUnnamed);
  EXPECT_EQ(offers.speaker()->card.host, "head");
  others.pulsing.reset();
  offers.look(both, others, 5 * kOneSecond);
  EXPECT_THAT(offers.hosts(), ElementsAre("far", "head")) << "it is not known who pulses";
}

TEST(Offers, OfTwoMachinesWithOneNameAreNamedOnceNoneIsAnEarlierLife) {
  Offers offers(kImage);
  const std::vector<Offer> both{offer(1, "head", 11, 1), offer(2, "head", 22, 2)};
  offers.look(both, {}, kOneSecond);
  offers.look(both, {}, kOneSecond + Offers::kNoEarlierLife - 1);
  EXPECT_EQ(offers.shared_name(), "");
  offers.look(both, {}, kOneSecond + Offers::kNoEarlierLife);
  EXPECT_EQ(offers.shared_name(), "head");
}

}  // namespace
}  // namespace arbiter::link
