// The daemon's segment: the decision tables of the last models, and which of them is in force.
//
// Thread safety: one writer, the daemon; any number of readers, that may stop or die anywhere.
// Invariants
//  1. `generation` counts the models; the table of generation g lies in slot g % kTableSlots.
//  2. While generation g is in force only slot (g + 1) % kTableSlots is written. So a table read
//     under generation s is whole if the generation, read again afterwards, is below
//     s + kTableSlots - 1.
//  3. Generation 0 has no table: no model has been loaded yet.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "shm/atomic.hpp"
#include "shm/decision_table.hpp"
#include "shm/limits.hpp"

namespace arbiter::shm {

inline constexpr std::uint32_t kTableSlots = 8;

struct Board {
  static constexpr std::uint64_t kMagic = 0x31647262'74696272;  // "rbitbrd1"
  static constexpr std::uint32_t kVersion = 2;

  std::uint64_t magic;
  std::uint32_t version;
  std::uint32_t table_words;
  alignas(kCacheLine) Atomic<std::uint64_t> generation;
  alignas(kPageSize) Atomic<Word> tables[kTableSlots][kMaxTableWords];
};

struct TableSnapshot {
  std::uint64_t generation = 0;
  TableView table;
};

class TableReader {
 public:
  TableReader() = default;
  explicit TableReader(const Board& board) noexcept : board_(&board) {}

  // SYNC POINT: table-in-force. Acquire; pairs with the release in TableWriter::put_in_force(): who
  // sees the generation sees its table.
  [[nodiscard]] TableSnapshot snapshot() const noexcept {
    const std::uint64_t generation = board_->generation.load(std::memory_order_acquire);
    if (generation == 0) return {};
    return {generation, TableView(board_->tables[generation % kTableSlots], kMaxTableWords)};
  }

  // To look whether there is a newer one, which snapshot() then reads. Relaxed is enough.
  [[nodiscard]] std::uint64_t generation() const noexcept {
    return board_->generation.load(std::memory_order_relaxed);
  }

  // Whether all that was read from the snapshot so far was the table's own.
  [[nodiscard]] bool is_whole(const TableSnapshot& snapshot) const noexcept {
    return generation_by_now() - snapshot.generation < kTableSlots - 1;
  }

  // Whether no other came into force either until all was read that a decision looked at: ends of
  // queues and activities of a later time belong to the next model's decisions.
  [[nodiscard]] bool is_in_force(const TableSnapshot& snapshot) const noexcept {
    return generation_by_now() == snapshot.generation;
  }

 private:
  // SYNC POINT: table-overwritten. The acquire fence pairs with the release fence in
  // TableWriter::write(): who has read a word of a newer table sees a newer generation here.
  [[nodiscard]] std::uint64_t generation_by_now() const noexcept {
    acquire_fence();
    return board_->generation.load(std::memory_order_relaxed);
  }

  const Board* board_ = nullptr;
};

class TableWriter {
 public:
  explicit TableWriter(Board& board) noexcept : board_(&board) {}

  static void initialize(Board& board) noexcept {
    board.magic = Board::kMagic;
    board.version = Board::kVersion;
    board.table_words = kMaxTableWords;
    board.generation.store(0, std::memory_order_relaxed);
  }

  [[nodiscard]] std::uint64_t next_generation() const noexcept {
    return board_->generation.load(std::memory_order_relaxed) + 1;
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
    board_->generation.store(next_generation(),
                             std::memory_order_release);  // SYNC POINT: table-in-force
  }

 private:
  Board* board_;
};

}  // namespace arbiter::shm
