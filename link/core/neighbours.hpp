// The hosts that a link knows: those whose links are there, and for some minutes those that were.
//
// A link is there while its card's writer is: the transport says when that is lost (a lease). A
// link that is started again has another incarnation; its earlier life is then not listed as gone.
//
// Units: nanoseconds of a monotonic clock. Thread safety: none of its own.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "link/core/host_card.hpp"

namespace arbiter::link {

struct Neighbour {
  std::uint64_t key = 0;  // by which the transport knows its card's writer; 0: it is gone
  std::shared_ptr<const HostCard> card;  // never null; copies cost little, however large it is
  bool is_up = true;
  shm::Nanoseconds since = 0;  // that it is up, or gone
  shm::Nanoseconds heard = 0;  // when its card came
};

class Neighbours {
 public:
  // Of all, whoever pretends to be one.
  static constexpr std::size_t kMost = 256;
  static constexpr shm::Nanoseconds kRemembered = 300'000'000'000;

  // The card of a writer that is there. False: there is no place for another host.
  bool note(std::uint64_t key, HostCard card, shm::Nanoseconds now);
  // All writers that were there at that time, or later: whose is not among them is gone. Who has
  // been heard since then may have come after they were counted, and is left alone.
  void keep(std::vector<std::uint64_t> keys, shm::Nanoseconds then);

  // In the order of names, those that are up first.
  [[nodiscard]] const std::vector<Neighbour>& all() const noexcept { return all_; }
  // Grows with each change of them.
  [[nodiscard]] std::uint64_t changes() const noexcept { return changes_; }

 private:
  void put_in_order();

  std::vector<Neighbour> all_;
  std::uint64_t changes_ = 0;
};

}  // namespace arbiter::link
