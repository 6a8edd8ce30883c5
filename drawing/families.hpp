// How the behaviours of a model are put on a page: who stands with whom, and which arrows there
// are.
#pragma once

#include <cstddef>
#include <vector>

#include "drawing/siblings.hpp"
#include "rules/model/hierarchy.hpp"

namespace arbiter::drawing {

struct Inhibition {
  std::size_t who, whom;  // behaviours
  const rules::Mention* mention;
};

// A behaviour, a box of behaviours (a meta-behaviour), or a group of behaviours in columns.
struct Unit {
  std::vector<std::size_t> members;  // behaviours; of a box it alone
  bool is_box = false;
  bool is_loose = false;  // a group of those who have nothing to do with their siblings
  bool inhibits = false, is_inhibited = false;
  std::vector<Inhibition> within;  // a group in which each inhibits the others
  Extent extent;
  std::size_t height = 1;  // of a group's columns
  // The behaviours that stand highest and lowest in it.
  std::vector<std::size_t> tops, bottoms;

  [[nodiscard]] bool is_group() const { return !is_box && members.size() > 1; }
  // It has a border, at which arrows end.
  [[nodiscard]] bool is_framed() const { return is_box || (is_group() && !is_loose); }
};

struct Arrow {
  std::size_t from = 0, to = 0;  // units
  Stroke stroke = Stroke::kDirect;
  bool leads_back = false;  // to the head of the next column: the end is not below the beginning
  std::vector<Inhibition> inhibitions;
};

// Pieces that stand beside each other.
struct Row {
  std::vector<std::size_t> units;
  std::vector<std::size_t> tops, bottoms;  // behaviours
  Extent extent{0, 0};
};

// Those under one parent.
struct Family {
  std::size_t parent;
  std::vector<Unit> units;
  std::vector<Arrow> arrows;
  std::vector<Row> rows;  // from above
  // Of pieces that are folded: the units at the heads of their columns.
  std::vector<std::vector<std::size_t>> folds;
};

class Families {
 public:
  Families(const rules::Model& model, const rules::Hierarchy& hierarchy);

  // A meta-behaviour is drawn as a box around others, if there are others.
  [[nodiscard]] bool is_box(std::size_t behaviour) const {
    return !hierarchy_.children(behaviour).empty();
  }
  [[nodiscard]] const Family& top() const { return families_.front(); }
  [[nodiscard]] const Family& of(std::size_t box) const { return families_[family_of_[box]]; }

 private:
  void add_family(std::size_t parent, const std::vector<std::size_t>& members);
  void measure(Family& family);

  const rules::Model& model_;
  const rules::Hierarchy& hierarchy_;
  std::vector<Family> families_;        // parents before their children
  std::vector<std::size_t> family_of_;  // by behaviour, of boxes
  std::vector<Unit> boxes_;  // by behaviour: how large the box is, and what is in it where
};

}  // namespace arbiter::drawing
