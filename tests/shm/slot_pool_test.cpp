#include "shm/slot_pool.hpp"

#include <gtest/gtest.h>

#include <set>

namespace arbiter::shm {
namespace {

constexpr PortInstance kOwner = 5;

// A publisher with a few queues, and the receivers' holds, played without threads. Every slot that
// it is given is checked against what is queued, held and lent.
class Play {
 public:
  Play(std::uint32_t queues, std::uint32_t depth, std::uint32_t max_held, std::uint32_t loans)
      : depth_(depth), queues_(queues), holds_(queues) {
    for (auto& receiver : holds_) {
      receiver = std::vector<Atomic<Hold>>(max_held);
      for (auto& hold : receiver) hold = 0;
    }
    pool_.grow(queues * depth + queues * max_held + loans);
  }
  Play(const Play&) = delete;

  std::uint32_t loan(bool recent = false) {
    const auto each_hold = [&](auto&& each) {
      for (const auto& receiver : holds_) {
        each(receiver.data(), static_cast<std::uint32_t>(receiver.size()));
      }
    };
    const std::uint32_t slot = pool_.acquire(kOwner, each_hold, recent);
    if (slot == kNoSlot) return slot;
    EXPECT_LT(slot, pool_.size());
    EXPECT_FALSE(is_queued(slot));
    EXPECT_FALSE(is_held(slot));
    EXPECT_TRUE(lent_.insert(slot).second);
    return slot;
  }
  void publish(std::uint32_t slot, unsigned accepted) {
    for (std::size_t queue = 0; queue < queues_.size(); ++queue) {
      if ((accepted >> queue & 1) == 0) continue;
      pool_.add_reference(slot);
      queues_[queue].push_back(slot);
      if (queues_[queue].size() <= depth_) continue;
      pool_.evict(queues_[queue].front());
      queues_[queue].erase(queues_[queue].begin());
    }
    lent_.erase(slot);
    pool_.end_loan(slot);
  }
  // All samples of a queue: its receiver is done with them.
  void forget(std::size_t queue) {
    for (const std::uint32_t slot : queues_[queue]) pool_.evict(slot);
    queues_[queue].clear();
  }
  // The newest sample of a queue, into a hold.
  void hold(std::size_t queue, std::size_t index) {
    holds_[queue][index] = queues_[queue].empty() ? 0 : make_hold(kOwner, queues_[queue].back());
  }
  [[nodiscard]] std::size_t lent() const { return lent_.size(); }
  SlotPool& pool() { return pool_; }
  Atomic<Hold>& hold_word(std::size_t queue, std::size_t index) { return holds_[queue][index]; }

 private:
  [[nodiscard]] bool is_queued(std::uint32_t slot) const {
    for (const auto& queue : queues_) {
      for (const auto other : queue) {
        if (other == slot) return true;
      }
    }
    return false;
  }
  [[nodiscard]] bool is_held(std::uint32_t slot) const {
    for (const auto& receiver : holds_) {
      for (const auto& hold : receiver) {
        if (hold.load() == make_hold(kOwner, slot)) return true;
      }
    }
    return false;
  }

  std::uint32_t depth_;
  std::vector<std::vector<std::uint32_t>> queues_;
  std::vector<std::vector<Atomic<Hold>>> holds_;
  std::set<std::uint32_t> lent_;
  SlotPool pool_;
};

// Every sequence of `length` moves: publish to a subset of the queues, or change a hold.
void play_all(std::uint32_t queues, std::uint32_t depth, std::uint32_t max_held, int length) {
  const std::size_t publishes = std::size_t{1} << queues;
  const std::size_t moves = publishes + std::size_t{queues} * max_held;
  std::size_t plays = 1;
  for (int i = 0; i < length; ++i) plays *= moves;
  for (std::size_t number = 0; number < plays; ++number) {
    Play play(queues, depth, max_held, 1);
    std::size_t rest = number;
    for (int i = 0; i < length; ++i, rest /= moves) {
      const std::size_t move = rest % moves;
      if (move < publishes) {
        const std::uint32_t slot = play.loan();
        ASSERT_NE(slot, kNoSlot) << "play " << number << ", move " << i;
        play.publish(slot, static_cast<unsigned>(move));
      } else {
        play.hold((move - publishes) / max_held, (move - publishes) % max_held);
      }
      if (testing::Test::HasFailure()) return;
    }
  }
}

TEST(SlotPool, TheLeastNumberOfSlotsIsAlwaysEnoughForOneQueue) {
  play_all(1, 1, 1, 9);
  play_all(1, 2, 1, 9);
  play_all(1, 1, 2, 8);
  play_all(1, 2, 2, 8);
}

TEST(SlotPool, TheLeastNumberOfSlotsIsAlwaysEnoughForTwoQueues) {
  play_all(2, 1, 1, 6);
  play_all(2, 2, 1, 6);
  play_all(2, 1, 2, 5);
}

TEST(SlotPool, OneSlotLessIsNotEnough) {
  Play play(1, 1, 1, 0);
  play.publish(play.loan(), 1);
  play.hold(0, 0);
  play.publish(play.loan(), 1);
  EXPECT_EQ(play.loan(), kNoSlot);
  ChannelReader::release(play.hold_word(0, 0));
  EXPECT_NE(play.loan(), kNoSlot);
}

TEST(SlotPool, SeveralLoansMayBeOutBesideFullQueuesAndHolds) {
  Play play(2, 2, 2, 3);
  for (std::size_t round = 0; round < 50; ++round) {
    std::uint32_t slots[3];
    for (auto& slot : slots) {
      slot = play.loan();
      ASSERT_NE(slot, kNoSlot);
    }
    EXPECT_EQ(play.lent(), 3u);
    for (unsigned i = 0; i < 3; ++i) {
      play.publish(slots[i], 1 + i % 3);
      play.hold(i % 2, round % 2);
    }
  }
}

TEST(SlotPool, TheHoldsOfAnotherPublisherDoNotCount) {
  Play play(1, 1, 1, 0);
  play.publish(play.loan(), 1);
  play.publish(play.loan(), 1);
  play.hold_word(0, 0) = make_hold(kOwner + 1, 0);
  EXPECT_NE(play.loan(), kNoSlot);
}

TEST(SlotPool, TheRecentOneOfThoseThatAreDoneWithComesFirst) {
  Play play(1, 2, 1, 1);
  const std::uint32_t first = play.loan();
  const std::uint32_t second = play.loan();
  for (const std::uint32_t slot : {first, second}) {
    play.publish(slot, 1);
  }
  play.forget(0);
  EXPECT_EQ(play.loan(true), second);
  EXPECT_EQ(play.loan(true), first);
}

TEST(SlotPool, TheRecentOneIsNotGivenOutWhileItIsHeld) {
  Play play(1, 2, 1, 1);
  const std::uint32_t slot = play.loan();
  play.publish(slot, 1);
  play.hold(0, 0);
  play.forget(0);
  const std::uint32_t other = play.loan(true);
  EXPECT_NE(other, slot);
  play.publish(other, 0);
  ChannelReader::release(play.hold_word(0, 0));
  EXPECT_EQ(play.loan(true), slot);
}

TEST(SlotPool, ALoanThatNobodyAcceptsIsFreeAgain) {
  Play play(1, 1, 1, 1);
  for (int i = 0; i < 100; ++i) play.publish(play.loan(), 0);
  EXPECT_EQ(play.pool().free_count(), play.pool().size());
}

TEST(SlotPool, BalancesWhereverTheSlotsAre) {
  Play play(2, 2, 2, 1);
  for (unsigned round = 0; round < 50; ++round) {
    play.pool().require_balance();
    play.publish(play.loan(), round % 4);
    play.hold(round % 2, round / 2 % 2);
  }
  play.pool().grow(play.pool().size() + 3);
  play.pool().require_balance();
}

// In releases too (shm/assertion.hpp).
TEST(SlotPoolDeathTest, ASlotIsNeverLostNorInTwoPlaces) {
  EXPECT_DEATH(
      {
        Play play(1, 1, 1, 0);
        static_cast<void>(play.loan());
        play.pool().require_balance();
      },
      "a mistake in the program: a slot is lost, or in two places");
  EXPECT_DEATH(
      {
        Play play(1, 1, 1, 0);
        play.pool().end_loan(play.pool().size() - 1);  // it was not out
        play.pool().require_balance();
      },
      "a slot is lost, or in two places");
  EXPECT_DEATH(
      {
        Play play(1, 1, 1, 0);
        play.pool().add_reference(play.pool().size() - 1);
        play.pool().require_balance();
      },
      "a slot is free that a queue names");
}

TEST(SlotPool, GrowingKeepsWhatIsInUseAndNeverShrinks) {
  Play play(1, 1, 1, 0);
  const std::uint32_t first = play.loan();
  const std::uint32_t before = play.pool().size();
  play.pool().grow(before - 1);
  EXPECT_EQ(play.pool().size(), before);
  play.pool().grow(before + 3);
  std::set<std::uint32_t> others;
  for (std::uint32_t slot = play.loan(); slot != kNoSlot; slot = play.loan()) others.insert(slot);
  EXPECT_EQ(others.size(), before + 2);
  EXPECT_EQ(others.count(first), 0u);
}

}  // namespace
}  // namespace arbiter::shm
