#include "rules/ask/inhibition_circle.hpp"

#include <algorithm>
#include <utility>

namespace arbiter::rules {
namespace {

// Circles that are passed over before no more are looked for.
constexpr std::size_t kMaxCirclesTried = 64;
// Ways from one to others that keep it out, looked at for more circles.
constexpr std::size_t kMaxWays = 1024;

class CircleSearch {
 public:
  CircleSearch(std::vector<VariableSet> keeps_out, Budget& budget,
               const std::function<bool(const Circle&)>& is_passed_over)
      : all_(std::move(keeps_out)),
        in_circles_(those_in_circles()),
        budget_(budget),
        is_passed_over_(is_passed_over) {}

  // A circle that is passed over goes with its inhibitions at first, which leads far with few
  // tries, then by itself.
  Circle find() {
    Circle found = find_without_those_tried();
    if (!found.empty() || tries_ == 0 || tries_ == kMaxCirclesTried) return found;
    tries_ = 0;
    for (std::size_t first = 0; first < all_.size() && tries_ < kMaxCirclesTried; ++first) {
      if (in_circles_[first]) found = find_behind(first);
      if (!found.empty()) break;
    }
    return found;
  }

 private:
  Circle find_without_those_tried() {
    std::vector<VariableSet> left = all_;
    for (std::size_t first = 0; first < left.size(); ++first) {
      while (in_circles_[first]) {
        Circle circle = shortest_circle(first, left);
        if (circle.empty()) break;
        if (!is_passed_over_(circle)) return circle;
        for (std::size_t i = 0; i < circle.size(); ++i) {
          left[circle[(i + 1) % circle.size()]].reset(circle[i]);
        }
        if (++tries_ == kMaxCirclesTried) return {};
      }
    }
    return {};
  }

  // Looks at the circles of the first and those behind it, the shortest first.
  Circle find_behind(std::size_t first) {
    std::vector<Circle> ways{{first}};
    for (std::size_t at = 0; at < ways.size(); ++at) {
      Circle way = ways[at];
      budget_.spend(way.size() * all_.size());  // to look along it for each that may follow
      for (std::size_t next = first; next < all_.size(); ++next) {
        if (!all_[next][way.back()]) continue;
        if (next == first) {
          if (!is_passed_over_(way)) return way;
          if (++tries_ == kMaxCirclesTried) return {};
        } else if (ways.size() < kMaxWays && std::find(way.begin(), way.end(), next) == way.end()) {
          ways.push_back(way);
          ways.back().push_back(next);
        }
      }
    }
    return {};
  }

  // All of them, and some between two circles: without those that keep nobody out, without those
  // that keep out nobody but them, and so on.
  [[nodiscard]] VariableSet those_in_circles() const {
    VariableSet left;
    for (std::size_t i = 0; i < all_.size(); ++i) left.set(i);
    for (VariableSet before; before != left;) {
      before = left;
      for (std::size_t i = 0; i < all_.size(); ++i) {
        if ((all_[i] & left).none()) left.reset(i);
      }
    }
    return left;
  }

  // To those that keep the first out, breadth first, and back to it. Empty: there is none.
  static Circle shortest_circle(std::size_t first, const std::vector<VariableSet>& keeps_out) {
    std::vector<std::size_t> from(keeps_out.size(), keeps_out.size());
    std::vector<std::size_t> reached{first};
    for (std::size_t at = 0; at < reached.size(); ++at) {
      for (std::size_t next = 0; next < keeps_out.size(); ++next) {
        if (!keeps_out[next][reached[at]]) continue;
        if (next == first) return way_to(reached[at], first, from);
        if (from[next] != keeps_out.size()) continue;
        from[next] = reached[at];
        reached.push_back(next);
      }
    }
    return {};
  }

  static Circle way_to(std::size_t last, std::size_t first, const std::vector<std::size_t>& from) {
    Circle way{last};
    while (way.back() != first) way.push_back(from[way.back()]);
    std::reverse(way.begin(), way.end());
    return way;
  }

  const std::vector<VariableSet> all_;  // who keeps out whom
  const VariableSet in_circles_;
  Budget& budget_;
  const std::function<bool(const Circle&)>& is_passed_over_;
  std::size_t tries_ = 0;
};

}  // namespace

Circle find_circle(std::vector<VariableSet> keeps_out, Budget& budget,
                   const std::function<bool(const Circle&)>& is_passed_over) {
  return CircleSearch(std::move(keeps_out), budget, is_passed_over).find();
}

}  // namespace arbiter::rules
