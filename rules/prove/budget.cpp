#include "rules/prove/budget.hpp"

#include <numeric>

namespace arbiter::rules {

void Budget::look() {
  look_at_ = spent_ + kLookEvery;
  if (stop_.stop_requested()) throw Stopped();
  if (watch_) watch_(progress_);
}

void Budget::throw_limit() const { throw StepLimit("more steps than there are for it"); }

void Budget::tell(Progress progress) {
  progress_ = std::move(progress);
  look();
}

std::vector<std::size_t> share_out(Budget& budget, const std::string& stage, std::size_t count,
                                   const std::function<std::string(std::size_t)>& name,
                                   const std::function<void(std::size_t)>& ask) {
  struct Question {
    std::size_t index;
    std::uint64_t had;  // steps, when it was asked last
  };
  std::vector<Question> open(count);
  for (std::size_t i = 0; i < count; ++i) open[i] = {i, 0};
  std::vector<std::size_t> given_up;
  while (!open.empty()) {
    std::vector<Question> still_open;
    for (std::size_t i = 0; i < open.size(); ++i) {
      const std::size_t index = open[i].index;
      const std::uint64_t part = budget.left() / (open.size() - i);
      budget.tell({stage, count - open.size() + i - still_open.size(), count, name(index)});
      const Budget::Part bound(budget, part);
      try {
        ask(index);
      } catch (const StepLimit&) {
        still_open.push_back({index, part});
      }
    }
    // Those that had most give up first, which leaves more to the others.
    std::stable_sort(still_open.begin(), still_open.end(),
                     [](const Question& a, const Question& b) { return a.had > b.had; });
    while (!still_open.empty() && 2 * (budget.left() / still_open.size()) <
                                      3 * std::max<std::uint64_t>(still_open.front().had, 1)) {
      given_up.push_back(still_open.front().index);
      still_open.erase(still_open.begin());
    }
    std::sort(still_open.begin(), still_open.end(),
              [](const Question& a, const Question& b) { return a.index < b.index; });
    open = std::move(still_open);
  }
  std::sort(given_up.begin(), given_up.end());
  return given_up;
}

}  // namespace arbiter::rules
