// The paper's figure 3: behaviours nested in meta-behaviours, red arrows for inhibitions.
#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "drawing/siblings.hpp"
#include "drawing/views.hpp"
#include "rules/model/hierarchy.hpp"
#include "rules/model/print_rules.hpp"

namespace arbiter::drawing {
namespace {

using rules::Behaviour;
using rules::Hierarchy;

constexpr std::size_t kNobody = Hierarchy::kNobody;

class BehavioursView {
 public:
  BehavioursView(const rules::LoadedModel& loaded, const Situation* situation, DotWriter& out)
      : model_(loaded.model),
        hierarchy_(model_, ignored_),
        situation_(situation),
        out_(out),
        states_(model_.behaviours.size(), State::kSilent) {
    std::vector<std::size_t> roots;
    for (std::size_t b = 0; b < model_.behaviours.size(); ++b) {
      if (hierarchy_.parent(b) == kNobody) roots.push_back(b);
    }
    find_states(loaded.rules);
    // Without recursion: the depth is the model's to choose.
    add_family(kNobody, std::move(roots));
    std::vector<std::size_t> boxes;
    const auto note_boxes = [&] {
      const auto& members = families_.back().members;
      std::copy_if(members.rbegin(), members.rend(), std::back_inserter(boxes),
                   [&](std::size_t member) { return is_box(member); });
    };
    for (note_boxes(); !boxes.empty(); note_boxes()) {
      const std::size_t box = boxes.back();
      boxes.pop_back();
      add_family(box, hierarchy_.children(box));
    }
    find_edges_of_boxes();
  }

  void draw() { draw_members(); }

 private:
  // Those under one parent.
  struct Family {
    std::size_t parent;
    std::vector<std::size_t> members;  // in document order of the parent's list
    Inhibitions inhibitions;           // by places in `members`
    std::vector<const rules::Mention*> mentions;
  };

  // A meta-behaviour is drawn as a box around others, if there are others.
  [[nodiscard]] bool is_box(std::size_t b) const { return !hierarchy_.children(b).empty(); }

  void add_family(std::size_t parent, std::vector<std::size_t> members) {
    Family family{parent, std::move(members), {}, {}};
    std::map<std::size_t, std::size_t> places;
    for (std::size_t i = 0; i < family.members.size(); ++i) places[family.members[i]] = i;
    std::set<std::pair<std::size_t, std::size_t>> known;
    for (const std::size_t inhibited : family.members) {
      for (const Hierarchy::Inhibitor& inhibitor : hierarchy_.inhibitors(inhibited)) {
        const std::pair pair{places.at(inhibitor.behaviour), places.at(inhibited)};
        if (!known.insert(pair).second) continue;
        family.inhibitions.push_back(pair);
        family.mentions.push_back(
            &model_.behaviours[inhibitor.behaviour].inhibitions[inhibitor.mention]);
      }
    }
    family_of_[parent] = families_.size();
    families_.push_back(std::move(family));
  }

  // Who stands highest and lowest in a box: whom nobody inhibits there, and who inhibits nobody.
  // Where inhibitions go in a circle, the first one.
  void find_edges_of_boxes() {
    tops_.resize(model_.behaviours.size());
    bottoms_.resize(model_.behaviours.size());
    for (std::size_t b = 0; b < model_.behaviours.size(); ++b) tops_[b] = bottoms_[b] = {b};
    for (std::size_t f = families_.size(); f-- > 1;) {
      const Family& family = families_[f];
      std::vector<bool> is_inhibited(family.members.size()), inhibits(family.members.size());
      for (const auto& [who, whom] : family.inhibitions) {
        inhibits[who] = true;
        is_inhibited[whom] = true;
      }
      tops_[family.parent] = collect(family, is_inhibited, tops_);
      bottoms_[family.parent] = collect(family, inhibits, bottoms_);
    }
  }

  static std::vector<std::size_t> collect(const Family& family, const std::vector<bool>& excluded,
                                          const std::vector<std::vector<std::size_t>>& edges) {
    std::vector<std::size_t> result;
    for (std::size_t i = 0; i < family.members.size(); ++i) {
      if (excluded[i]) continue;
      const auto& edge = edges[family.members[i]];
      result.insert(result.end(), edge.begin(), edge.end());
    }
    return result.empty() ? edges[family.members.front()] : result;
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
      for (std::size_t at = b; at != kNobody; at = hierarchy_.parent(at)) {
        states_[at] = std::max(states_[at], state->second);
      }
    }
  }

  [[nodiscard]] const char* mark(std::size_t b) const {
    if (situation_ == nullptr) return "";
    return states_[b] == State::kRuns ? "▶ " : states_[b] == State::kOverridden ? "✕ " : "○ ";
  }
  [[nodiscard]] std::string fill(std::size_t b) const {
    return quoted(states_[b] == State::kRuns         ? colour::kPaleWins
                  : states_[b] == State::kOverridden ? colour::kPaleOverridden
                                                     : colour::kPaper);
  }

  static std::string row(const std::string& content) {
    return "<TR><TD ALIGN=\"LEFT\">" + content + "</TD></TR>";
  }

  // What is the same for a behaviour and a box: name and conditions.
  [[nodiscard]] std::string heading(std::size_t b) const {
    const Behaviour& behaviour = model_.behaviours[b];
    std::string rows = row("<B>" + html(mark(b) + behaviour.name) + "</B>");
    for (const rules::Condition& condition : behaviour.conditions) {
      rows += row("<FONT POINT-SIZE=\"9\"><I>" + html("if " + to_string(*condition.expression)) +
                  "</I></FONT>");
    }
    return rows;
  }

  static std::string table(const std::string& rows) {
    return R"(<<TABLE BORDER="0" CELLBORDER="0" CELLSPACING="0" CELLPADDING="1">)" + rows +
           "</TABLE>>";
  }

  static std::string id(std::size_t b) { return "b" + std::to_string(b); }
  static std::string cluster(std::size_t b) { return "cluster_b" + std::to_string(b); }

  void draw_behaviour(std::size_t b) {
    const Behaviour& behaviour = model_.behaviours[b];
    std::string rows = heading(b);
    for (const rules::Config& config : behaviour.configs) {
      rows +=
          row("<FONT POINT-SIZE=\"9\">" + html(config.source + " → " + config.port) + "</FONT>");
    }
    out_.statement(id(b), {{"shape", "box"},
                           {"style", "\"rounded,filled\""},
                           {"margin", "\"0.08,0.04\""},
                           {"color", quoted(colour::kPlain)},
                           {"penwidth", states_[b] == State::kRuns ? "2.5" : "1"},
                           {"fillcolor", fill(b)},
                           {"tooltip", quoted(behaviour.name + "\n" + place(behaviour.where))},
                           {"label", table(rows)}});
  }

  void open_box(std::size_t b, int depth) {
    const Behaviour& behaviour = model_.behaviours[b];
    out_.open("subgraph " + cluster(b));
    out_.attribute("style", "\"rounded,filled\"");
    // Its colour shows the depth; that it runs, its border.
    const bool runs = states_[b] == State::kRuns;
    out_.attribute("color", quoted(runs ? colour::kWins : colour::kPlain));
    out_.attribute("penwidth", runs ? "2.5" : "1");
    out_.attribute("fillcolor", quoted(depth % 2 == 0 ? "#F4F4F4" : colour::kShade));
    out_.attribute("labeljust", "l");
    out_.attribute("margin", "12");
    out_.attribute("tooltip", quoted(behaviour.name + "\n" + place(behaviour.where)));
    out_.attribute("label", table(heading(b)));
  }

  void draw_members() {
    struct Open {
      const Family* family;
      std::size_t next = 0;
    };
    std::vector<Open> open{{&families_.front()}};
    while (!open.empty()) {
      Open& at = open.back();
      if (at.next == at.family->members.size()) {
        draw_family(*at.family);
        if (open.size() > 1) out_.close();
        open.pop_back();
        continue;
      }
      const std::size_t member = at.family->members[at.next++];
      if (is_box(member)) {
        open_box(member, static_cast<int>(open.size()) - 1);
        open.push_back({&families_[family_of_.at(member)]});
      } else {
        draw_behaviour(member);
      }
    }
  }

  void draw_family(const Family& family) {
    const auto detours = find_detours(family.members.size(), family.inhibitions);
    for (std::size_t i = 0; i < family.inhibitions.size(); ++i) {
      const std::size_t who = family.members[family.inhibitions[i].first];
      const std::size_t whom = family.members[family.inhibitions[i].second];
      const bool faint = detours[i];
      out_.statement(id(bottoms_[who].front()) + " -> " + id(tops_[whom].front()),
                     {{"ltail", is_box(who) ? cluster(who) : ""},
                      {"lhead", is_box(whom) ? cluster(whom) : ""},
                      {"minlen", is_box(who) || is_box(whom) ? "2" : ""},  // a box cuts its end off
                      {"color", quoted(std::string(colour::kInhibition) + (faint ? "70" : ""))},
                      {"penwidth", faint ? "0.8" : "1.8"},
                      {"tooltip", quoted(model_.behaviours[who].name + " inhibits " +
                                         model_.behaviours[whom].name + "\n" +
                                         place(family.mentions[i]->where))}});
      if (!faint && (is_box(who) || is_box(whom))) put_below(who, whom);
    }
    for (const auto& column : arrange_loners(family.members.size(), family.inhibitions)) {
      for (std::size_t i = 1; i < column.size(); ++i) {
        put_below(family.members[column[i - 1]], family.members[column[i]]);
      }
    }
  }

  // An arrow holds two in order, not the rest of their boxes. An unseen point between the boxes
  // does: all of the one are above it, all of the other below.
  void put_below(std::size_t above, std::size_t below) {
    static constexpr const char* kUnseen = "invis";
    if (!is_box(above) && !is_box(below)) {
      out_.statement(id(above) + " -> " + id(below), {{"style", kUnseen}});
      return;
    }
    const std::string joint = "j" + std::to_string(joints_++);
    out_.statement(joint, {{"shape", "point"}, {"width", "0"}, {"style", kUnseen}});
    for (const std::size_t b : bottoms_[above]) {
      out_.statement(id(b) + " -> " + joint, {{"style", kUnseen}, {"weight", "0"}});
    }
    for (const std::size_t b : tops_[below]) {
      out_.statement(joint + " -> " + id(b), {{"style", kUnseen}, {"weight", "0"}});
    }
  }

  const rules::Model& model_;
  rules::Diagnostics ignored_;  // it was all reported when the model was loaded
  const Hierarchy hierarchy_;
  const Situation* situation_;
  DotWriter& out_;
  std::vector<State> states_;  // of a box, the liveliest in it
  std::vector<Family> families_;
  std::map<std::size_t, std::size_t> family_of_;  // by parent
  std::vector<std::vector<std::size_t>> tops_, bottoms_;
  int joints_ = 0;
};

}  // namespace

void draw_behaviours(const rules::LoadedModel& model, const Situation* situation, DotWriter& out) {
  BehavioursView(model, situation, out).draw();
}

}  // namespace arbiter::drawing
