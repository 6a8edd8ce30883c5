// A table that is overwritten while it is read is noticed (shm/table_ring.hpp).
#include <sys/mman.h>

#include "shm/table_ring.hpp"
#include "tests/explore/case.hpp"

namespace arbiter::explore::table_ring_cases {
namespace {

class Tables {
 public:
  Tables()
      : board_(
            *static_cast<shm::Board*>(mmap(nullptr, sizeof(shm::Board), PROT_READ | PROT_WRITE,
                                           MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0))) {}
  ~Tables() { munmap(&board_, sizeof board_); }

  // Each table tells its own generation, twice.
  void swap(shm::TableWriter& writer) {
    shm::Word words[shm::table::kHeaderWords] = {};
    words[shm::table::kSourceCountAt] = words[shm::table::kPortCountAt] =
        static_cast<shm::Word>(writer.next_generation());
    writer.write(words);
    writer.put_in_force();
  }

  Explorer::Scenario read_while_swapping(int swaps) {
    return [this, swaps](Execution& execution) {
      shm::TableWriter::initialize(board_);
      shm::TableWriter writer(board_);
      for (int i = 0; i < 3; ++i) swap(writer);
      execution.thread([this, swaps] {
        shm::TableWriter again(board_);
        for (int i = 0; i < swaps; ++i) swap(again);
      });
      execution.thread([this] {
        const shm::TableReader reader(board_);
        const shm::TableSnapshot snapshot = reader.snapshot();
        const shm::Word first = snapshot.table.source_count();
        const shm::Word second = snapshot.table.port_count();
        if (!reader.is_whole(snapshot)) return;
        require(first == snapshot.generation && second == snapshot.generation,
                "a table was taken for whole that was not");
      });
    };
  }

 private:
  shm::Board& board_;
};

const Register kSwaps("ATableThatIsOverwrittenWhileItIsReadIsNeverTakenForWhole", {3, 2},
                      [](const Explore& explore) {
                        Tables tables;
                        explore(tables.read_while_swapping(shm::kTableSlots));
                      });

}  // namespace
}  // namespace arbiter::explore::table_ring_cases
