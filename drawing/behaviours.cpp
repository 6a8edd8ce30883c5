// The paper's figure 3: behaviours nested in meta-behaviours, red arrows for inhibitions.
#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "drawing/families.hpp"
#include "drawing/text.hpp"
#include "drawing/views.hpp"
#include "rules/model/hierarchy.hpp"
#include "rules/model/print_rules.hpp"

namespace arbiter::drawing {
namespace {

using rules::Behaviour;
using rules::Hierarchy;

constexpr const char* kUnseen = "invis";
constexpr std::size_t kNameWidth = 32, kPortWidth = 26, kFormulaWidth = 38;  // characters
constexpr std::size_t kConditionLines = 3;                                   // of a condition
constexpr std::size_t kMostRows = 6;       // connections of a behaviour
constexpr std::size_t kTooltipLines = 60;  // lines

std::string id(std::size_t b) { return "b" + std::to_string(b); }

std::string in_red(const char* sign) { return small(sign, colour::kRed); }

std::string table(const std::string& rows) {
  return R"(<<TABLE BORDER="0" CELLBORDER="0" CELLSPACING="0" CELLPADDING="1">)" + rows +
         "</TABLE>>";
}

class BehavioursView {
 public:
  BehavioursView(const rules::LoadedModel& loaded, const Situation* situation, DotWriter& out)
      : model_(loaded.model),
        hierarchy_(model_, ignored_),
        families_(model_, hierarchy_),
        situation_(situation),
        out_(out),
        states_(model_.behaviours.size(), State::kSilent),
        implied_(model_.behaviours.size()) {
    find_states(loaded.rules);
  }

  // Without recursion: the depth is the model's to choose.
  void draw() {
    std::vector<Open> open;
    enter(open, families_.top());
    while (!open.empty()) {
      Open& at = open.back();
      if (at.next == at.family->units.size()) {
        leave(open);
        continue;
      }
      const Unit& unit = at.family->units[at.next++];
      if (unit.is_box) {
        open_box(unit.members.front(), static_cast<int>(open.size()) - 1);
        enter(open, families_.of(unit.members.front()));
      } else {
        draw_group(unit);
      }
    }
  }

 private:
  // A family of which some units are drawn.
  struct Open {
    const Family* family;
    std::size_t next = 0;
  };

  void enter(std::vector<Open>& open, const Family& family) {
    open.push_back({&family});
    for (const Arrow& arrow : family.arrows) {
      if (arrow.stroke != Stroke::kImplied) continue;
      for (const Inhibition& each : arrow.inhibitions) implied_[each.who].push_back(each);
      out_.note_sign(kAllAfter);
    }
  }

  void leave(std::vector<Open>& open) {
    draw_arrows(*open.back().family);
    open.pop_back();
    if (open.empty()) return;
    const Unit& box = open.back().family->units[open.back().next - 1];
    draw_ends(box);
    out_.close();
  }

  void find_states(const rules::RuleSet& rules) {
    if (situation_ == nullptr) return;
    std::map<std::string, State> by_name;
    for (const rules::BehaviourRules& behaviour : rules.behaviours) {
      by_name[behaviour.name] = state_of(behaviour, *situation_);
    }
    for (std::size_t b = 0; b < model_.behaviours.size(); ++b) {
      const auto state = by_name.find(model_.behaviours[b].name);
      if (state == by_name.end()) continue;
      for (std::size_t at = b; at != Hierarchy::kNobody; at = hierarchy_.parent(at)) {
        states_[at] = std::max(states_[at], state->second);
      }
    }
  }

  [[nodiscard]] const Mark& mark(std::size_t b) const {
    return look_of(states_[b] == State::kRuns         ? MarkKind::kRuns
                   : states_[b] == State::kOverridden ? MarkKind::kOverridden
                                                      : MarkKind::kInactive);
  }

  // What is the same for a behaviour and a box: name and conditions.
  [[nodiscard]] std::string heading(std::size_t b) const {
    const Behaviour& behaviour = model_.behaviours[b];
    std::string name = situation_ == nullptr ? "" : std::string(mark(b).sign) + " ";
    name = "<B>" + html(name + shortened(behaviour.name, kNameWidth)) + "</B>";
    if (!implied_[b].empty()) name += "  " + in_red(kAllAfter);
    std::string rows = row(name);
    for (const rules::Condition& condition : behaviour.conditions) {
      const std::string text = "if " + to_string(*condition.expression);
      rows +=
          row(small("<I>" + html_lines(in_lines(text, kFormulaWidth, kConditionLines)) + "</I>"));
    }
    return rows;
  }

  static void add_line(std::string& text, std::size_t number, std::size_t of,
                       const std::string& line) {
    if (number < kTooltipLines) text.append("\n").append(line);
    if (number + 1 == of && of > kTooltipLines) {
      text.append("\nand ").append(std::to_string(of - kTooltipLines)).append(" more");
    }
  }

  // All that is shortened, or has no arrow.
  [[nodiscard]] std::string tooltip(std::size_t b) const {
    const Behaviour& behaviour = model_.behaviours[b];
    std::string text = behaviour.name + "\n" + place(behaviour.where);
    for (const rules::Condition& condition : behaviour.conditions) {
      text += "\nif " + to_string(*condition.expression);
    }
    const auto& configs = behaviour.configs;
    for (std::size_t i = 0; i < configs.size(); ++i) {
      add_line(text, i, configs.size(), configs[i].source + " → " + configs[i].port);
    }
    const auto& implied = implied_[b];
    for (std::size_t i = 0; i < implied.size(); ++i) {
      add_line(text, i, implied.size(), in_words(implied[i]));
    }
    return quoted(text);
  }

  [[nodiscard]] std::string in_words(const Inhibition& inhibition) const {
    return model_.behaviours[inhibition.who].name + " inhibits " +
           model_.behaviours[inhibition.whom].name + ", " + place(inhibition.mention->where);
  }

  void draw_behaviour(std::size_t b) {
    const Behaviour& behaviour = model_.behaviours[b];
    std::string rows = heading(b);
    const std::size_t count = behaviour.configs.size();
    const std::size_t shown = count > kMostRows ? kMostRows - 1 : count;
    for (std::size_t i = 0; i < shown; ++i) {
      const rules::Config& config = behaviour.configs[i];
      rows += row(small(
          html(shortened(config.source, kPortWidth) + " → " + shortened(config.port, kPortWidth))));
    }
    if (shown < count) rows += row(small("and " + std::to_string(count - shown) + " more"));
    out_.statement(id(b), {{"shape", "box"},
                           {"style", "\"rounded,filled\""},
                           {"margin", "\"0.08,0.04\""},
                           {"color", quoted(colour::kBlack)},
                           {"penwidth", states_[b] == State::kRuns ? "2.5" : "1"},
                           {"fillcolor", quoted(mark(b).colour)},
                           {"tooltip", tooltip(b)},
                           {"label", table(rows)}});
  }

  void draw_group(const Unit& unit) {
    if (unit.is_framed()) open_group(unit);
    for (const std::size_t member : unit.members) draw_behaviour(member);
    if (unit.is_group()) draw_columns(unit);
    if (!unit.is_framed()) return;
    draw_ends(unit);
    out_.close();
  }

  void open_group(const Unit& unit) {
    const bool is_mutual = !unit.within.empty();
    std::string text = "an arrow to or from this is one for each in it";
    for (std::size_t i = 0; i < unit.within.size(); ++i) {
      add_line(text, i, unit.within.size(), in_words(unit.within[i]));
    }
    out_.open("subgraph " + cluster(unit));
    out_.attribute("style", "\"rounded,dashed\"");
    out_.attribute("color",
                   quoted(is_mutual ? look_of(LineKind::kInhibits).colour : colour::kGrey));
    out_.attribute("penwidth", is_mutual ? "1.8" : "1");
    out_.attribute("labeljust", "l");
    out_.attribute("margin", "8");
    out_.attribute("tooltip", quoted(text));
    out_.attribute("label", is_mutual ? table(row(in_red(kMutual))) : "\"\"");
    if (is_mutual) out_.note_sign(kMutual);
  }

  void draw_columns(const Unit& unit) {
    for (std::size_t i = 1; i < unit.members.size(); ++i) {
      if (i % unit.height == 0) continue;
      out_.statement(id(unit.members[i - 1]) + " -> " + id(unit.members[i]),
                     {{"style", kUnseen}, {"weight", "10"}});
    }
  }

  void open_box(std::size_t b, int depth) {
    out_.open("subgraph cluster_" + id(b));
    out_.attribute("style", "\"rounded,filled\"");
    // Its colour shows the depth; that it runs, its border.
    const bool runs = states_[b] == State::kRuns;
    out_.attribute("color", quoted(runs ? colour::kGreen : colour::kBlack));
    out_.attribute("penwidth", runs ? "2.5" : "1");
    out_.attribute("fillcolor", quoted(depth % 2 == 0 ? colour::kPaleGrey : colour::kShade));
    out_.attribute("labeljust", "l");
    out_.attribute("margin", "12");
    out_.attribute("tooltip", tooltip(b));
    out_.attribute("label", table(heading(b)));
  }

  static std::string cluster(const Unit& unit) {
    return (unit.is_box ? "cluster_" : "cluster_of_") + id(unit.members.front());
  }

  // Where arrows to a unit end, and those from it begin: at a behaviour, or at an unseen point
  // above or below all that is in the unit. They are cut off at its border.
  static std::string head(const Unit& unit) {
    return unit.tops.size() == 1 ? id(unit.tops.front()) : "above_" + id(unit.members.front());
  }
  static std::string tail(const Unit& unit) {
    return unit.bottoms.size() == 1 ? id(unit.bottoms.front())
                                    : "below_" + id(unit.members.front());
  }

  void draw_point(const std::string& name) {
    out_.statement(name, {{"shape", "point"}, {"width", "0"}, {"style", kUnseen}});
  }

  void draw_ends(const Unit& unit) {
    if (unit.is_inhibited && unit.tops.size() > 1) {
      draw_point(head(unit));
      for (const std::size_t b : unit.tops) hold(head(unit), id(b));
    }
    if (unit.inhibits && unit.bottoms.size() > 1) {
      draw_point(tail(unit));
      for (const std::size_t b : unit.bottoms) hold(id(b), tail(unit));
    }
  }

  // Holds the one above the other.
  void hold(const std::string& above, const std::string& below) {
    out_.statement(above + " -> " + below, {{"style", kUnseen}, {"weight", "1"}});
  }

  void draw_arrows(const Family& family) {
    for (const Arrow& arrow : family.arrows) {
      if (arrow.stroke != Stroke::kImplied) draw_arrow(family, arrow);
    }
    for (const auto& heads : family.folds) put_beside(family, heads);
    for (std::size_t i = 1; i < family.rows.size(); ++i) {
      const std::string joint = "joint" + std::to_string(joints_++);
      draw_point(joint);
      for (const std::size_t b : family.rows[i - 1].bottoms) hold(id(b), joint);
      for (const std::size_t b : family.rows[i].tops) hold(joint, id(b));
    }
  }

  // In this order, from the left to the right: Graphviz keeps the order of lines from one point
  // where nothing speaks against it.
  void put_beside(const Family& family, const std::vector<std::size_t>& units) {
    const std::string joint = "joint" + std::to_string(joints_++);
    draw_point(joint);
    for (const std::size_t unit : units) hold(joint, id(family.units[unit].tops.front()));
  }

  void draw_arrow(const Family& family, const Arrow& arrow) {
    const Unit& from = family.units[arrow.from];
    const Unit& to = family.units[arrow.to];
    std::string text;
    for (std::size_t i = 0; i < arrow.inhibitions.size(); ++i) {
      add_line(text, i, arrow.inhibitions.size(), in_words(arrow.inhibitions[i]));
    }
    out_.line(arrow.stroke == Stroke::kPast ? LineKind::kInhibitsPast : LineKind::kInhibits,
              tail(from) + " -> " + head(to),
              {{"ltail", from.is_framed() ? cluster(from) : ""},
               {"lhead", to.is_framed() ? cluster(to) : ""},
               // A border cuts its end off.
               {"minlen", from.is_framed() || to.is_framed() ? "2" : ""},
               {"weight", "3"},
               {"constraint", arrow.leads_back ? "false" : ""},
               {"tooltip", quoted(text.substr(1))}});
  }

  const rules::Model& model_;
  rules::Diagnostics ignored_;  // it was all reported when the model was loaded
  const Hierarchy hierarchy_;
  const Families families_;
  const Situation* situation_;
  DotWriter& out_;
  std::vector<State> states_;                     // of a box, the liveliest in it
  std::vector<std::vector<Inhibition>> implied_;  // that have no arrow, by who inhibits
  int joints_ = 0;
};

}  // namespace

void draw_behaviours(const rules::LoadedModel& model, const Situation* situation, DotWriter& out) {
  BehavioursView(model, situation, out).draw();
}

}  // namespace arbiter::drawing
