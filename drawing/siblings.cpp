#include "drawing/siblings.hpp"

#include <algorithm>
#include <cmath>

namespace arbiter::drawing {
namespace {

constexpr std::size_t kMaxSiblings = 300;

// The siblings so that inhibitors come first; fewer than all where inhibitions go in a circle.
std::vector<std::size_t> sort(const std::vector<std::vector<std::size_t>>& inhibited) {
  std::vector<std::size_t> inhibitors(inhibited.size(), 0);
  for (const auto& list : inhibited) {
    for (const std::size_t i : list) ++inhibitors[i];
  }
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < inhibited.size(); ++i) {
    if (inhibitors[i] == 0) order.push_back(i);
  }
  for (std::size_t done = 0; done < order.size(); ++done) {
    for (const std::size_t i : inhibited[order[done]]) {
      if (--inhibitors[i] == 0) order.push_back(i);
    }
  }
  return order;
}

}  // namespace

std::vector<bool> find_detours(std::size_t siblings, const Inhibitions& inhibitions) {
  std::vector<bool> detours(inhibitions.size(), false);
  if (siblings > kMaxSiblings) return detours;
  std::vector<std::vector<std::size_t>> inhibited(siblings);
  for (const auto& [who, whom] : inhibitions) inhibited[who].push_back(whom);
  const auto order = sort(inhibited);
  if (order.size() < siblings) return detours;
  // reaches[i][j]: some way of inhibitions leads from i to j.
  std::vector<std::vector<bool>> reaches(siblings, std::vector<bool>(siblings, false));
  for (std::size_t n = siblings; n-- > 0;) {
    const std::size_t i = order[n];
    for (const std::size_t next : inhibited[i]) {
      reaches[i][next] = true;
      for (std::size_t j = 0; j < siblings; ++j) {
        if (reaches[next][j]) reaches[i][j] = true;
      }
    }
  }
  for (std::size_t e = 0; e < inhibitions.size(); ++e) {
    const auto [who, whom] = inhibitions[e];
    detours[e] = std::any_of(inhibited[who].begin(), inhibited[who].end(),
                             [&, last = whom](std::size_t next) { return reaches[next][last]; });
  }
  return detours;
}

std::vector<std::vector<std::size_t>> arrange_loners(std::size_t siblings,
                                                     const Inhibitions& inhibitions) {
  std::vector<bool> is_linked(siblings, false);
  for (const auto& [who, whom] : inhibitions) is_linked[who] = is_linked[whom] = true;
  std::vector<std::size_t> loners;
  for (std::size_t i = 0; i < siblings; ++i) {
    if (!is_linked[i]) loners.push_back(i);
  }
  const auto height = static_cast<std::size_t>(std::lround(std::sqrt(loners.size())));
  std::vector<std::vector<std::size_t>> columns;
  for (std::size_t i = 0; i < loners.size(); ++i) {
    if (i % height == 0) columns.emplace_back();
    columns.back().push_back(loners[i]);
  }
  return columns;
}

}  // namespace arbiter::drawing
