// A ring that the daemon's loop asks for while another, that it has asked for before, begins in the
// thread of an errand (service/ports/pending_ring.hpp).
#include "service/ports/pending_ring.hpp"
#include "tests/explore/components.hpp"

namespace arbiter::explore::ring_cases {
namespace {

struct Asked {
  Asked() { static_cast<void>(pending.ask()); }
  service::PendingRing pending;
  shm::Atomic<std::uint32_t> news{0};
  bool is_pending = false;
  std::uint32_t seen = 0;
};

void ask_again(const Explore& explore) {
  explore_anew<Asked>(explore, [](Asked& asked, Execution& execution) {
    execution.thread([&asked] {
      asked.news.store(1, std::memory_order_relaxed);
      asked.is_pending = asked.pending.ask();
    });
    execution.thread([&asked] {
      asked.pending.begin();
      asked.seen = asked.news.load(std::memory_order_relaxed);
    });
    execution.finally([&asked] {
      require(!asked.is_pending || asked.seen == 1, "a ring that was to tell of news missed them");
    });
  });
}
const Register kAskAgain("ARingThatIsPendingTellsOfAllThatCameBefore", {2, 2}, ask_again);

}  // namespace
}  // namespace arbiter::explore::ring_cases
