#include "shm/table_ring.hpp"

#include <gtest/gtest.h>
#include <sys/mman.h>

#include <new>

namespace arbiter::shm {
namespace {

class TableRing : public testing::Test {
 protected:
  // A board is large, and hardly any of it is touched.
  static void* reserve() {
    return mmap(nullptr, sizeof(Board), PROT_READ | PROT_WRITE,
                MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  }
  TableRing() : board_(*static_cast<Board*>(reserve())), writer_(board_), reader_(board_) {
    TableWriter::initialize(board_);
  }
  ~TableRing() override { munmap(&board_, sizeof(Board)); }

  void swap(Word mark) {
    std::vector<Word> words(table::kHeaderWords);
    words[table::kMagicAt] = table::kMagic;
    words[table::kVersionAt] = table::kVersion;
    words[table::kSourceCountAt] = mark;
    writer_.write(words);
    writer_.put_in_force();
  }

  Board& board_;
  TableWriter writer_;
  TableReader reader_;
};

TEST_F(TableRing, BeforeTheFirstModelThereIsNoTable) {
  const TableSnapshot none = reader_.snapshot();
  EXPECT_EQ(none.generation, 0u);
  EXPECT_FALSE(none.table.is_table());
  EXPECT_TRUE(reader_.is_whole(none));
}

TEST_F(TableRing, ATableCountsOnlyOnceItIsPutInForce) {
  writer_.write(std::vector<Word>(table::kHeaderWords, 1));
  EXPECT_EQ(reader_.generation(), 0u);
  EXPECT_EQ(writer_.next_table().source_count(), 1u);
  writer_.put_in_force();
  EXPECT_EQ(reader_.generation(), 1u);
}

TEST_F(TableRing, ASnapshotIsWholeForFewerThanSevenSwapsAndThenNot) {
  for (Word before = 1; before <= 2 * kTableSlots; ++before) {
    swap(before);
    const TableSnapshot snapshot = reader_.snapshot();
    ASSERT_EQ(snapshot.table.source_count(), before);
    for (Word swaps = 1; swaps < kTableSlots - 1; ++swaps) {
      swap(1000 + swaps);
      EXPECT_TRUE(reader_.is_whole(snapshot)) << swaps << " swaps";
      EXPECT_EQ(snapshot.table.source_count(), before);
    }
    swap(2000);
    EXPECT_FALSE(reader_.is_whole(snapshot)) << "its slot may be written now";
    before = static_cast<Word>(reader_.generation());
  }
}

TEST_F(TableRing, TheTableThatIsBeingWrittenIsNeverOneThatCountsAsWhole) {
  swap(1);
  const TableSnapshot snapshot = reader_.snapshot();
  for (Word swaps = 0; swaps < kTableSlots; ++swaps) {
    if (reader_.is_whole(snapshot)) {
      writer_.write(std::vector<Word>(table::kHeaderWords, 99));
      EXPECT_EQ(snapshot.table.source_count(), 1u) << "after " << swaps << " swaps";
    }
    swap(7);
  }
}

TEST_F(TableRing, TheOffsetToAllocateIsThatOfTheNextTable) {
  for (int i = 0; i < 10; ++i) {
    const auto* next = reinterpret_cast<const std::byte*>(&board_) + writer_.next_offset();
    writer_.write(std::vector<Word>{0xabcd});
    EXPECT_EQ(*reinterpret_cast<const Word*>(next), 0xabcdu);
    writer_.put_in_force();
  }
}

}  // namespace
}  // namespace arbiter::shm
