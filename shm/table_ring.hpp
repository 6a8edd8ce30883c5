// The daemon's segment: the decision tables of the last models, which of them is in force, and
// which page of each source is.
//
// Thread safety: one writer, the daemon; any number of readers, that may stop or die anywhere.
// Invariants
//  1. An epoch is a generation and a number of pages. The generation counts the models; the table
//     of generation g lies in slot g % kTableSlots. The number is another each time that a source's
//     page is replaced (activity_pages.hpp), so that one comparison tells a decision that it was
//     taken under one model and on one page of each source.
//  2. While generation g is in force only slot (g + 1) % kTableSlots is written. So a table read
//     under generation s is whole if the generation, read again afterwards, is below
//     s + kTableSlots - 1.
//  3. Generation 0 has no table: no model has been loaded yet.
//  4. The number of pages comes round after 2^24. A port that has slept so long binds its rules
//     again all the same, since its node has been sent pages meanwhile; or it was sent none, and
//     has nothing to bind again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "shm/activity_pages.hpp"
#include "shm/atomic.hpp"
#include "shm/decision_table.hpp"
#include "shm/limits.hpp"

namespace arbiter::shm {

inline constexpr std::uint32_t kTableSlots = 8;

using Epoch = std::uint64_t;
inline constexpr int kGenerationBits = 40;

constexpr std::uint64_t generation_of(Epoch epoch) noexcept {
  return epoch & ((std::uint64_t{1} << kGenerationBits) - 1);
}

struct Board {
  static constexpr std::uint64_t kMagic = 0x31647262'74696272;  // "rbitbrd1"
  static constexpr std::uint32_t kVersion = 3;

  std::uint64_t magic;
  std::uint32_t version;
  std::uint32_t table_words;
  alignas(kCacheLine) Atomic<Epoch> epoch;
  alignas(kCacheLine) PageNumbers pages;
  alignas(kPageSize) Atomic<Word> tables[kTableSlots][kMaxTableWords];
};

struct TableSnapshot {
  Epoch epoch = 0;
  std::uint64_t generation = 0;
  TableView table;
};

class TableReader {
 public:
  TableReader() = default;
  explicit TableReader(const Board& board) noexcept : board_(&board) {}

  // SYNC POINT: table-in-force. Acquire; pairs with the release in TableWriter::put_in_force(): who
  // sees the generation sees its table. SYNC POINT: page-in-force. And with the release in
  // change_page(): who sees the epoch sees which pages are in force.
  [[nodiscard]] TableSnapshot snapshot() const noexcept {
    const Epoch epoch = board_->epoch.load(std::memory_order_acquire);
    const std::uint64_t generation = generation_of(epoch);
    if (generation == 0) return {epoch, 0, {}};
    return {epoch, generation, TableView(board_->tables[generation % kTableSlots], kMaxTableWords)};
  }

  // To look whether there is a newer one, which snapshot() then reads. Relaxed is enough.
  [[nodiscard]] Epoch epoch() const noexcept {
    return board_->epoch.load(std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint64_t generation() const noexcept { return generation_of(epoch()); }
  [[nodiscard]] const PageNumbers& pages() const noexcept { return board_->pages; }

  // Whether all that was read from the snapshot so far was the table's own.
  [[nodiscard]] bool is_whole(const TableSnapshot& snapshot) const noexcept {
    return generation_of(epoch_by_now()) - snapshot.generation < kTableSlots - 1;
  }

  // Whether no other came into force either, nor another page of a source, until all was read that
  // a decision looked at: ends of queues and activities of a later time belong to the next model's
  // decisions, and no decision mixes moments of two pages.
  [[nodiscard]] bool is_in_force(const TableSnapshot& snapshot) const noexcept {
    return epoch_by_now() == snapshot.epoch;
  }

 private:
  // SYNC POINT: table-overwritten. The acquire fence pairs with the release fence in
  // TableWriter::write(): who has read a word of a newer table sees a newer epoch here.
  [[nodiscard]] Epoch epoch_by_now() const noexcept {
    acquire_fence();
    return board_->epoch.load(std::memory_order_relaxed);
  }

  const Board* board_ = nullptr;
};

class TableWriter {
 public:
  TableWriter() = default;
  explicit TableWriter(Board& board) noexcept : board_(&board) {}

  static void initialize(Board& board) noexcept {
    board.magic = Board::kMagic;
    board.version = Board::kVersion;
    board.table_words = kMaxTableWords;
    board.epoch.store(0, std::memory_order_relaxed);
  }

  [[nodiscard]] std::uint64_t next_generation() const noexcept {
    return generation_of(epoch()) + 1;
  }
  // The bytes that the next table will take up, for allocating them first.
  [[nodiscard]] std::size_t next_offset() const noexcept {
    return offsetof(Board, tables) +
           (next_generation() % kTableSlots) * sizeof(Word) * kMaxTableWords;
  }

  // Writes the next table, which is not yet in force. At most kMaxTableWords words.
  void write(std::span<const Word> words) noexcept {
    release_fence();  // SYNC POINT: table-overwritten
    Atomic<Word>* slot = board_->tables[next_generation() % kTableSlots];
    for (std::size_t i = 0; i < words.size(); ++i) {
      slot[i].store(words[i], std::memory_order_relaxed);
    }
  }
  [[nodiscard]] TableView next_table() const noexcept {
    return {board_->tables[next_generation() % kTableSlots], kMaxTableWords};
  }

  void put_in_force() noexcept {
    board_->epoch.store(epoch() + 1, std::memory_order_release);  // SYNC POINT: table-in-force
  }

  // A daemon that takes over finds in the registry what was written down before it.
  [[nodiscard]] PageNumber page_number(SourceId id) const noexcept { return board_->pages.of(id); }
  // A source's first page, or its next, for which nothing is carried on: no table in force reads
  // it. SYNC POINT: page-in-force. Release, as in change_page().
  void give_page(SourceId id, PageNumber number) noexcept {
    board_->pages.numbers[id].store(number, std::memory_order_release);
  }
  // The source's next page comes into force, and carries the activity on. What is written to the
  // old one later counts no more; who has not mapped the new one finds none. SYNC POINT:
  // page-in-force. The first release pairs with the acquire in PageNumbers::of(): who sees the
  // number sees the activity. The second pairs with the acquire in TableReader::snapshot(): who
  // sees the epoch sees the number.
  void change_page(SourceId id, const Activity& before, Activity& next) noexcept {
    next.carry_on(before);
    give_page(id, page_number(id) + 1);
    renew_pages();
  }
  // Makes everybody look which pages are in force: a daemon that takes over does it too, for its
  // predecessor may have died within change_page().
  void renew_pages() noexcept {
    board_->epoch.store(epoch() + (Epoch{1} << kGenerationBits), std::memory_order_release);
  }

 private:
  [[nodiscard]] Epoch epoch() const noexcept {
    return board_->epoch.load(std::memory_order_relaxed);
  }

  Board* board_ = nullptr;
};

}  // namespace arbiter::shm
