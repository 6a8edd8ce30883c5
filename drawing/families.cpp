#include "drawing/families.hpp"

#include <algorithm>
#include <functional>
#include <map>
#include <set>
#include <utility>

namespace arbiter::drawing {
namespace {

using Members = std::vector<std::size_t>;
using rules::Hierarchy;

constexpr double kHeightOfTitle = 0.5;  // of a box, in cells

void arrange_group(Unit& group, std::size_t height) {
  const Members& members = group.members;
  group.height = height;
  const std::size_t columns = (members.size() + height - 1) / height;
  group.extent = {static_cast<double>(columns),
                  static_cast<double>(std::min(height, members.size()))};
  group.tops.clear();
  group.bottoms.clear();
  for (std::size_t first = 0; first < members.size(); first += height) {
    group.tops.push_back(members[first]);
    group.bottoms.push_back(members[std::min(first + height, members.size()) - 1]);
  }
}

Inhibitions between_units(const std::vector<Arrow>& arrows) {
  Inhibitions result;
  for (const Arrow& arrow : arrows) result.emplace_back(arrow.from, arrow.to);
  return result;
}

// Joins what is between the same two units, and says what is to be drawn of it.
std::vector<Arrow> make_arrows(std::vector<Unit>& units,
                               const std::vector<Inhibition>& inhibitions) {
  std::map<std::size_t, std::size_t> unit_of;
  for (std::size_t u = 0; u < units.size(); ++u) {
    for (const std::size_t member : units[u].members) unit_of[member] = u;
  }
  std::vector<Arrow> arrows;
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> known;
  for (const Inhibition& inhibition : inhibitions) {
    const std::pair ends{unit_of.at(inhibition.who), unit_of.at(inhibition.whom)};
    if (ends.first == ends.second) {
      units[ends.first].within.push_back(inhibition);
      continue;
    }
    const auto [found, is_new] = known.try_emplace(ends, arrows.size());
    if (is_new) arrows.push_back({ends.first, ends.second, Stroke::kDirect, false, {}});
    arrows[found->second].inhibitions.push_back(inhibition);
  }
  const auto strokes = find_strokes(units.size(), between_units(arrows));
  for (std::size_t a = 0; a < arrows.size(); ++a) arrows[a].stroke = strokes[a];
  return arrows;
}

// How much room a piece takes; one that is too high is folded, by arrows that lead back.
Extent arrange_piece(Family& family, const Members& piece, const std::vector<std::size_t>& ranks) {
  std::map<std::size_t, Extent> by_rank;
  for (const std::size_t unit : piece) {
    auto [rank, is_new] = by_rank.try_emplace(ranks[unit], Extent{0, 0});
    const Extent& extent = family.units[unit].extent;
    rank->second.width += extent.width;
    rank->second.height = std::max(rank->second.height, extent.height);
  }
  Extent whole{0, 0};
  for (const auto& [rank, extent] : by_rank) {
    whole.width = std::max(whole.width, extent.width);
    whole.height += extent.height;
  }
  const std::size_t columns = columns_of_fold(whole);
  const std::size_t ranks_in_column = (by_rank.size() + columns - 1) / columns;
  if (columns == 1) return whole;
  const std::set<std::size_t> members(piece.begin(), piece.end());
  for (Arrow& arrow : family.arrows) {
    if (!members.contains(arrow.from)) continue;
    arrow.leads_back = ranks[arrow.from] / ranks_in_column != ranks[arrow.to] / ranks_in_column;
  }
  family.folds.emplace_back();
  for (std::size_t rank = 0; rank < by_rank.size(); rank += ranks_in_column) {
    family.folds.back().push_back(*std::find_if(
        piece.begin(), piece.end(), [&](std::size_t unit) { return ranks[unit] == rank; }));
  }
  const auto count = static_cast<double>(columns);
  return {whole.width * count, whole.height / count};
}

// Who stands highest and lowest in a row: whom no arrow holds below another, and who holds nobody
// below him. Where inhibitions go in a circle, the first one.
void find_edges(const Family& family, Row& row) {
  std::vector<bool> is_below(family.units.size()), is_above(family.units.size());
  for (const Arrow& arrow : family.arrows) {
    if (arrow.stroke == Stroke::kImplied || arrow.leads_back) continue;
    is_above[arrow.from] = true;
    is_below[arrow.to] = true;
  }
  const auto add = [](Members& to, const Members& some) {
    to.insert(to.end(), some.begin(), some.end());
  };
  for (const std::size_t unit : row.units) {
    if (!is_below[unit]) add(row.tops, family.units[unit].tops);
    if (!is_above[unit]) add(row.bottoms, family.units[unit].bottoms);
  }
  const Unit& first = family.units[row.units.front()];
  if (row.tops.empty()) row.tops = first.tops;
  if (row.bottoms.empty()) row.bottoms = first.bottoms;
}

void arrange_family(Family& family) {
  const Inhibitions pairs = between_units(family.arrows);
  const auto ranks = find_ranks(family.units.size(), pairs);
  auto pieces = find_pieces(family.units.size(), pairs);
  const auto is_loose = [&](const Members& piece) { return family.units[piece.front()].is_loose; };
  // Those who are loose fill what room there is beside the others.
  std::stable_partition(pieces.begin(), pieces.end(), std::not_fn(is_loose));
  std::vector<Extent> extents;
  double highest = 0;
  for (const Members& piece : pieces) {
    Unit& unit = family.units[piece.front()];
    if (unit.is_loose && highest > unit.extent.height) {
      arrange_group(unit, static_cast<std::size_t>(highest));
    }
    extents.push_back(arrange_piece(family, piece, ranks));
    highest = std::max(highest, extents.back().height);
  }
  for (const auto& places : arrange_in_rows(extents)) {
    Row row;
    for (const std::size_t piece : places) {
      row.extent.width += extents[piece].width;
      row.extent.height = std::max(row.extent.height, extents[piece].height);
      row.units.insert(row.units.end(), pieces[piece].begin(), pieces[piece].end());
    }
    find_edges(family, row);
    family.rows.push_back(std::move(row));
  }
}

}  // namespace

Families::Families(const rules::Model& model, const Hierarchy& hierarchy)
    : model_(model),
      hierarchy_(hierarchy),
      family_of_(model.behaviours.size()),
      boxes_(model.behaviours.size()) {
  Members roots;
  for (std::size_t b = 0; b < model_.behaviours.size(); ++b) {
    if (hierarchy_.parent(b) == Hierarchy::kNobody) roots.push_back(b);
  }
  // Without recursion: the depth is the model's to choose.
  add_family(Hierarchy::kNobody, roots);
  for (std::size_t done = 0; done < families_.size();) {
    Members boxes;
    for (const Unit& unit : families_[done++].units) {
      if (unit.is_box) boxes.push_back(unit.members.front());
    }
    for (const std::size_t box : boxes) add_family(box, hierarchy_.children(box));
  }
  for (std::size_t f = families_.size(); f-- > 0;) measure(families_[f]);
}

void Families::add_family(std::size_t parent, const Members& members) {
  std::map<std::size_t, std::size_t> places;
  for (std::size_t i = 0; i < members.size(); ++i) places[members[i]] = i;
  std::vector<Inhibition> inhibitions;
  Inhibitions pairs;
  std::vector<bool> may_join;
  for (const std::size_t inhibited : members) {
    may_join.push_back(!is_box(inhibited));
    std::set<std::size_t> known;
    for (const Hierarchy::Inhibitor& inhibitor : hierarchy_.inhibitors(inhibited)) {
      const std::size_t who = inhibitor.behaviour;
      if (!known.insert(who).second) continue;
      inhibitions.push_back(
          {who, inhibited, &model_.behaviours[who].inhibitions[inhibitor.mention]});
      pairs.emplace_back(places.at(who), places.at(inhibited));
    }
  }
  Family family{parent, {}, {}, {}, {}};
  for (const Members& twins : find_twins(pairs, may_join)) {
    Unit unit;
    for (const std::size_t place : twins) unit.members.push_back(members[place]);
    unit.is_box = is_box(unit.members.front());
    family.units.push_back(std::move(unit));
  }
  family.arrows = make_arrows(family.units, inhibitions);
  for (const Arrow& arrow : family.arrows) {
    family.units[arrow.from].inhibits = true;
    family.units[arrow.to].is_inhibited = true;
  }
  for (Unit& unit : family.units) {
    unit.is_loose = !unit.is_box && !unit.inhibits && !unit.is_inhibited && unit.within.empty();
  }
  if (parent != Hierarchy::kNobody) family_of_[parent] = families_.size();
  families_.push_back(std::move(family));
}

// When those of the boxes in it are measured.
void Families::measure(Family& family) {
  for (Unit& unit : family.units) {
    if (unit.is_box) {
      const Unit& box = boxes_[unit.members.front()];
      unit.extent = box.extent;
      unit.tops = box.tops;
      unit.bottoms = box.bottoms;
    } else {
      arrange_group(unit, height_of_grid(unit.members.size()));
    }
  }
  arrange_family(family);
  if (family.parent == Hierarchy::kNobody) return;
  Unit& box = boxes_[family.parent];
  box.extent = {0, kHeightOfTitle};
  for (const Row& row : family.rows) {
    box.extent.width = std::max(box.extent.width, row.extent.width);
    box.extent.height += row.extent.height;
  }
  box.tops = family.rows.front().tops;
  box.bottoms = family.rows.back().bottoms;
}

}  // namespace arbiter::drawing
