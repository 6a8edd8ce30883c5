// One budget of steps for a whole run, spent fairly.
//
// A step is a small, fixed amount of work: two nodes of diagrams are combined, or one is looked at.
// It takes about a tenth of a microsecond. Steps are counted and not time, so that every machine
// gives the same answer.
//
// A run has many questions (ports, statements, pairs of ports), of which a few may be hard. Each is
// given the same part of what is left; what it does not use goes to the others. Those that did not
// come to an end are asked again with a larger part, as long as one is left: share_out(). So a hard
// question takes nothing from the easy ones, and a single hard one gets nearly all.
//
// Thread safety: a budget is for one thread. The stop token that it is made with may be triggered
// by another one.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

namespace arbiter::rules {

// A question could not be answered within its bounds. What remains of the diagrams it was asked
// with: see StepLimit, and DiagramBuilder for the others.
class DiagramLimit : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The steps are used up. All diagrams stay valid.
class StepLimit : public DiagramLimit {
 public:
  using DiagramLimit::DiagramLimit;
};

// The run was asked to stop. It has no result.
class Stopped : public std::runtime_error {
 public:
  Stopped() : std::runtime_error("stopped before it was finished") {}
};

// How far a run is.
struct Progress {
  std::string stage;     // what is done now: "proving"
  std::size_t done = 0;  // questions of this stage
  std::size_t of = 0;
  std::string name;  // the question at hand: a port
};

class Budget {
 public:
  using Watch = std::function<void(const Progress&)>;

  // Of a run: where all of it is needed, most of a minute.
  static constexpr std::uint64_t kSteps = 500'000'000;
  // How many times as many may be asked for.
  static constexpr double kLeastEffort = 0.001, kMostEffort = 1000;
  static std::uint64_t steps_of(double effort) {
    return static_cast<std::uint64_t>(static_cast<double>(kSteps) * effort);
  }
  static constexpr std::uint64_t kNoLimit = ~std::uint64_t{0};

  explicit Budget(std::uint64_t steps = kSteps, std::stop_token stop = {})
      : limit_(steps), stop_(std::move(stop)) {}
  Budget(const Budget&) = delete;
  Budget& operator=(const Budget&) = delete;

  // Throws StepLimit if more was spent than there is, and Stopped.
  void spend(std::uint64_t steps) {
    note(steps);
    if (spent_ > limit_) throw_limit();
  }
  // Of what has been done already. Throws Stopped only.
  void note(std::uint64_t steps) {
    spent_ += steps;
    if (spent_ >= look_at_) look();
  }

  [[nodiscard]] std::uint64_t spent() const { return spent_; }
  // Of the part at hand.
  [[nodiscard]] std::uint64_t left() const { return limit_ - std::min(limit_, spent_); }

  // While it lives, no more than `steps` of what is left can be spent.
  class Part {
   public:
    Part(Budget& budget, std::uint64_t steps) : budget_(budget), limit_(budget.limit_) {
      budget.limit_ = budget.spent_ + std::min(steps, budget.left());
    }
    Part(const Part&) = delete;
    Part& operator=(const Part&) = delete;
    ~Part() { budget_.limit_ = limit_; }

   private:
    Budget& budget_;
    const std::uint64_t limit_;  // outside of it
  };

  // While it lives, there is no limit: for work that takes no more than what was spent before.
  class Overdraft {
   public:
    explicit Overdraft(Budget& budget) : budget_(budget), limit_(budget.limit_) {
      budget.limit_ = kNoLimit;
    }
    Overdraft(const Overdraft&) = delete;
    Overdraft& operator=(const Overdraft&) = delete;
    ~Overdraft() { budget_.limit_ = limit_; }

   private:
    Budget& budget_;
    const std::uint64_t limit_;
  };

  // Is called at each question, and every few milliseconds; in the thread that spends.
  void watch(Watch watch) { watch_ = std::move(watch); }
  void tell(Progress progress);

 private:
  static constexpr std::uint64_t kLookEvery = 1u << 15;

  void look();
  [[noreturn]] void throw_limit() const;

  std::uint64_t spent_ = 0;
  std::uint64_t limit_;
  std::uint64_t look_at_ = 0;
  std::stop_token stop_;
  Watch watch_;
  Progress progress_;
};

// Asks `count` questions, each within its part of what is left. ask(i) throws StepLimit if the
// question needs more than that, and is then called again where there is at least half as
// much again for it. Returns those that stay open, in their order. `name(i)` is for the progress.
std::vector<std::size_t> share_out(Budget& budget, const std::string& stage, std::size_t count,
                                   const std::function<std::string(std::size_t)>& name,
                                   const std::function<void(std::size_t)>& ask);

}  // namespace arbiter::rules
