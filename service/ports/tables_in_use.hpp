// The decision tables of a predecessor that readers may still look at.
#pragma once

#include <cstdint>

#include "shm/table_ring.hpp"

namespace arbiter::service {

class TablesInUse {
 public:
  explicit TablesInUse(const shm::Board& board)
      : board_(board), newest_(shm::TableReader(board).generation()) {}

  [[nodiscard]] std::uint64_t newest() const { return newest_; }
  // The last generation whose table knows that id; 0: none does. `knows`: TableView::knows_source,
  // or knows_port.
  template <class Id>
  [[nodiscard]] std::uint64_t last_naming(Id id,
                                          bool (shm::TableView::*knows)(Id) const noexcept) const {
    // All but the one that is written next.
    for (std::uint64_t age = 0; age < shm::kTableSlots - 1 && age < newest_; ++age) {
      const auto& words = board_.tables[(newest_ - age) % shm::kTableSlots];
      if ((shm::TableView(words, shm::kMaxTableWords).*knows)(id)) return newest_ - age;
    }
    return 0;
  }

 private:
  const shm::Board& board_;
  const std::uint64_t newest_;
};

}  // namespace arbiter::service
