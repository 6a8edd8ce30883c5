#include "drawing/siblings.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

namespace arbiter::drawing {
namespace {

constexpr std::size_t kMaxSiblings = 1000;
constexpr std::size_t kLeastTwins = 3;
constexpr double kMaxHeight = 14;   // of a piece that is not folded
constexpr double kLeastFold = 2.5;  // what is nearer to one or two columns stays one

// A page looks well if it is a little wider than high. A cell is 46 mm wide and 23 high.
constexpr double kRowsForEachColumn = 1.7;

using Lists = std::vector<std::vector<std::size_t>>;

Lists inhibited_by_each(std::size_t siblings, const Inhibitions& inhibitions) {
  Lists inhibited(siblings);
  for (const auto& [who, whom] : inhibitions) inhibited[who].push_back(whom);
  return inhibited;
}

// The siblings so that inhibitors come first; fewer than all where inhibitions go in a circle.
std::vector<std::size_t> sort(const Lists& inhibited) {
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

std::vector<Stroke> find_strokes(std::size_t siblings, const Inhibitions& inhibitions) {
  std::vector<Stroke> strokes(inhibitions.size(), Stroke::kDirect);
  if (siblings > kMaxSiblings) return strokes;
  const Lists inhibited = inhibited_by_each(siblings, inhibitions);
  const auto order = sort(inhibited);
  if (order.size() < siblings) return strokes;
  // reaches[i][j]: some way of inhibitions leads from i to j; past[i][j]: one of several steps.
  std::vector<std::vector<bool>> reaches(siblings, std::vector<bool>(siblings, false));
  auto past = reaches;
  for (std::size_t n = siblings; n-- > 0;) {
    const std::size_t i = order[n];
    for (const std::size_t next : inhibited[i]) {
      // What can be reached by way of one who can be reached so himself has been noted with him.
      reaches[i][next] = true;
      if (past[i][next]) continue;
      for (std::size_t j = 0; j < siblings; ++j) {
        if (reaches[next][j]) reaches[i][j] = past[i][j] = true;
      }
    }
  }
  for (std::size_t e = 0; e < inhibitions.size(); ++e) {
    const auto [who, whom] = inhibitions[e];
    if (!past[who][whom]) continue;
    const auto reached = std::count(reaches[who].begin(), reaches[who].end(), true);
    const bool inhibits_all = static_cast<std::size_t>(reached) == inhibited[who].size();
    strokes[e] = inhibits_all ? Stroke::kImplied : Stroke::kPast;
  }
  return strokes;
}

Lists find_twins(const Inhibitions& inhibitions, const std::vector<bool>& may_join) {
  struct Relations {
    std::vector<std::size_t> inhibitors, inhibited;
    bool operator<(const Relations& other) const {
      return std::tie(inhibitors, inhibited) < std::tie(other.inhibitors, other.inhibited);
    }
  };
  const std::size_t siblings = may_join.size();
  std::vector<Relations> relations(siblings);
  for (const auto& [who, whom] : inhibitions) {
    relations[who].inhibited.push_back(whom);
    relations[whom].inhibitors.push_back(who);
  }
  Lists groups(siblings);
  for (std::size_t i = 0; i < siblings; ++i) groups[i] = {i};
  std::vector<bool> is_free = may_join;
  const auto group_alike = [&] {
    std::map<Relations, std::vector<std::size_t>> alike;
    for (std::size_t i = 0; i < siblings; ++i) {
      std::sort(relations[i].inhibitors.begin(), relations[i].inhibitors.end());
      std::sort(relations[i].inhibited.begin(), relations[i].inhibited.end());
      if (is_free[i]) alike[relations[i]].push_back(i);
    }
    for (const auto& [related, members] : alike) {
      const bool are_loners = related.inhibitors.empty() && related.inhibited.empty();
      if (!are_loners && members.size() < kLeastTwins) continue;
      for (const std::size_t member : members) {
        groups[member].clear();
        is_free[member] = false;
      }
      groups[members.front()] = members;
    }
  };
  group_alike();
  // Those who inhibit each other, and are alike but for that, become alike so.
  for (std::size_t i = 0; i < siblings; ++i) {
    relations[i].inhibitors.push_back(i);
    relations[i].inhibited.push_back(i);
  }
  group_alike();
  std::erase_if(groups, [](const auto& group) { return group.empty(); });
  return groups;
}

Lists find_pieces(std::size_t siblings, const Inhibitions& inhibitions) {
  std::vector<std::size_t> first(siblings);  // towards the first of the piece
  std::iota(first.begin(), first.end(), std::size_t{0});
  const auto find = [&](std::size_t i) {
    while (first[i] != i) i = first[i] = first[first[i]];
    return i;
  };
  for (const auto& [who, whom] : inhibitions) {
    const auto [low, high] = std::minmax({find(who), find(whom)});
    first[high] = low;
  }
  Lists pieces(siblings);
  for (std::size_t i = 0; i < siblings; ++i) pieces[find(i)].push_back(i);
  std::erase_if(pieces, [](const auto& piece) { return piece.empty(); });
  return pieces;
}

std::vector<std::size_t> find_ranks(std::size_t siblings, const Inhibitions& inhibitions) {
  std::vector<std::size_t> ranks(siblings, 0);
  const Lists inhibited = inhibited_by_each(siblings, inhibitions);
  const auto order = sort(inhibited);
  if (order.size() < siblings) return ranks;
  for (const std::size_t who : order) {
    for (const std::size_t whom : inhibited[who]) {
      ranks[whom] = std::max(ranks[whom], ranks[who] + 1);
    }
  }
  return ranks;
}

Lists arrange_in_rows(const std::vector<Extent>& pieces) {
  double area = 0, width = 0;
  for (const Extent& piece : pieces) {
    area += piece.width * piece.height;
    width += piece.width;
  }
  // Half as wide again is no reason for another row; and the last one is not to be a short rest.
  const double wish = 1.5 * std::sqrt(area / kRowsForEachColumn);
  const double share = width / std::max(1.0, std::ceil(width / wish));
  Lists rows;
  double used = 0;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (rows.empty() || used + pieces[i].width / 2 > share) {
      rows.emplace_back();
      used = 0;
    }
    rows.back().push_back(i);
    used += pieces[i].width;
  }
  return rows;
}

std::size_t height_of_grid(std::size_t count) {
  const auto wish = std::lround(std::sqrt(static_cast<double>(count)));
  return std::max<std::size_t>(1, static_cast<std::size_t>(wish));
}

std::size_t columns_of_fold(const Extent& piece) {
  if (piece.height <= kMaxHeight) return 1;
  const double wish = std::sqrt(piece.height / piece.width / kRowsForEachColumn);
  return wish < kLeastFold ? 1 : static_cast<std::size_t>(std::lround(wish));
}

}  // namespace arbiter::drawing
