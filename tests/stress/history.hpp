// The checker: from what components wrote down, was all of it right?
//
// Of a call only the times of its beginning and its return are known; it took effect at some
// instant between them. So a source was *surely* active from the return of an arrival until T after
// that arrival's beginning, or until a deactivation began; and surely inactive between what ends
// activity for certain and the beginning of the next arrival. In between nothing is claimed. A rule
// was surely false throughout a call if one of its literals was, whatever model may have been in
// force meanwhile. Checked of each take of a sample:
//   - its rule was not surely false throughout the take: above all, nothing of an overridden source
//     is taken by a take that began after the override's publish() had returned
//   - it was published before it was taken, and bears a time of arrival between its publish()'s
//     beginning and end
//   - the samples of a source come in their order, none twice; and where one publish() had returned
//     before another began, of whatever source, the samples come in that order
// and of each arrival:
//   - it was accepted at no more ports than those where its rule was not surely false,
//   - and at no fewer than those where its rule was surely true.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/stress/plan.hpp"
#include "tests/stress/records.hpp"

namespace arbiter::stress {

// When another model was asked for, and when it was seen in force.
struct Swap {
  std::int64_t begin;
  std::int64_t end;
  std::uint32_t model;
};

struct Checked {
  std::uint64_t arrivals = 0;
  std::uint64_t takes = 0;
  std::uint64_t hard_takes = 0;  // of which another source was surely overriding something
  std::uint64_t too_few = 0;     // arrivals accepted at fewer ports than surely right
};

class History {
 public:
  // `swaps` begin with model 0.
  History(const Plan& plan, Records& records, std::vector<Swap> swaps);

  // Reports to the records what is wrong. Without `all_open`, some ports came and went, and
  // discarding is not judged.
  Checked check(bool all_open);

 private:
  struct Interval {
    std::int64_t from;
    std::int64_t until;
  };
  struct SourceHistory {
    std::vector<Interval> active;
    std::vector<Interval> inactive;
    std::vector<std::uint32_t> by_number;  // index in the log
  };
  // What is sure of all sources throughout a call; calls must come in the order of their beginning.
  class Picture {
   public:
    explicit Picture(const History& history) : history_(history), at_(history.sources_.size()) {}
    void look(std::int64_t begin, std::int64_t end);
    SourceSet active = 0;
    SourceSet inactive = 0;
    std::uint32_t models = 0;  // those that may have been in force, a bit each

   private:
    struct Cursor {
      std::size_t active = 0;
      std::size_t inactive = 0;
    };
    static bool covers(const std::vector<Interval>& intervals, std::size_t& at, std::int64_t begin,
                       std::int64_t end);
    const History& history_;
    std::vector<Cursor> at_;
    std::size_t model_ = 0;
  };

  void read_source(std::uint32_t source);
  void check_port(std::uint32_t port, Checked& checked);
  void check_source(std::uint32_t source, bool all_open, Checked& checked);
  [[nodiscard]] bool may_win(std::uint32_t port, std::uint32_t source,
                             const Picture& picture) const;
  [[nodiscard]] bool surely_wins(std::uint32_t port, std::uint32_t source,
                                 const Picture& picture) const;
  void fail(std::uint32_t port, std::uint64_t at, const std::string& what);
  [[nodiscard]] std::string describe(const Taking& taking) const;

  const Plan& plan_;
  Records& records_;
  std::vector<Swap> swaps_;
  std::vector<SourceHistory> sources_;
};

}  // namespace arbiter::stress
