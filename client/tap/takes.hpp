// What an input port has dropped at the take, and what was overtaken in its queues, as a tap sees
// it: from the counters that the port keeps anyway, in memory that the tap cannot write.
//
// How many there were is exact: all that is told adds up to what the port's own counters have grown
// by. Of which source they were is told as far as the port's lanes say it: a lane that the port has
// given up takes with it what it counted last, and what a publisher that has gone leaves behind is
// counted by no lane.
//
// Thread safety: one thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "shm/ids.hpp"
#include "shm/input_segment.hpp"

namespace arbiter::detail {

class TakeWatch {
 public:
  struct News {
    bool is_overtaken = false;  // else dropped at the take
    std::uint64_t count = 0;    // of samples
    shm::SourceId source = shm::kNone;
    std::uint64_t sequence = 0;  // the port is done with the source's samples up to this one; 0: no
                                 // source is known
  };

  // From here on all is told. The segment outlives this; what it says may be anything.
  explicit TakeWatch(const shm::InputSegment& segment) noexcept;

  // Appends what is new; at most two for each lane, and two more. `is_last`: the port has closed,
  // and its component writes there no more.
  void look(bool is_last, std::vector<News>& news);

 private:
  // One of the port's two counters, and what has been told of it.
  struct Account {
    std::uint64_t begin = 0;
    std::uint64_t told = 0;     // since then
    std::uint64_t of_none = 0;  // that no lane had counted, when we looked last
  };
  struct Lane {
    shm::PortInstance publisher = 0;
    std::uint64_t link = 0;
    std::array<std::uint64_t, 2> told{};  // by kind, as below
  };

  using Totals = std::array<std::uint64_t, 2>;
  [[nodiscard]] Totals totals() const noexcept;
  void look_at(const shm::Lane& lane, Lane& known, const Totals& totals, std::vector<News>& news);

  const shm::InputSegment* segment_;
  std::array<Account, 2> accounts_;  // dropped, overtaken
  Totals last_{};
  std::array<Lane, shm::kMaxLanes> lanes_;
};

}  // namespace arbiter::detail
