// The paper's figure 2: components and their ports, the connections, and what each arbiter selects.
#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "drawing/views.hpp"
#include "rules/model/print_rules.hpp"

namespace arbiter::drawing {
namespace {

// "/Gaze/pos:i" and "/Gaze" belong to "Gaze": components put their name in front of their ports'.
std::string component_of(std::string_view port) {
  if (port.starts_with('/')) port.remove_prefix(1);
  const std::size_t slash = port.find('/');
  if (slash != std::string_view::npos && slash > 0) return std::string(port.substr(0, slash));
  const std::size_t colon = port.rfind(':');
  return std::string(colon == std::string_view::npos || colon == 0 ? port : port.substr(0, colon));
}

// Breaks a long rule in front of its conjuncts.
std::string broken(const std::string& rule) {
  constexpr std::size_t kWidth = 60;
  static constexpr std::string_view kAnd = " ∧ ";
  std::string result;
  std::size_t line = 0, done = 0;
  for (std::size_t at = rule.find(kAnd); done < rule.size(); at = rule.find(kAnd, at + 1)) {
    const std::size_t end = std::min(at, rule.size());
    if (line > 0 && line + (end - done) > kWidth) {
      result += "\n    ";
      line = 4;
    }
    result += rule.substr(done, end - done);
    line += end - done;
    done = end;
    if (at == std::string::npos) break;
  }
  return result;
}

class ConnectionsView {
 public:
  ConnectionsView(const rules::LoadedModel& loaded, const Situation* situation, DotWriter& out)
      : rules_(loaded.rules), situation_(situation), out_(out) {
    for (const rules::PortRules& port : rules_.ports) input(port.port).rules = &port;
    for (const rules::Connection& connection : rules_.other_connections) {
      input(connection.port).others.push_back(connection.source);
      output(connection.source);
    }
    for (const std::string& source : rules_.sources) output(source);
    int component = 0;
    for (auto& [name, ports] : components_) {
      ports.id = "c" + std::to_string(component++);
      int number = 0;
      for (auto& [port, in] : ports.inputs) in.id = "i" + std::to_string(number++);
      for (auto& [port, id] : ports.outputs) id = "o" + std::to_string(number++);
    }
  }

  void draw() {
    for (const auto& [name, component] : components_) draw_component(name, component);
    for (const auto& [name, component] : components_) {
      for (const auto& [port, in] : component.inputs) draw_edges(component.id, port, in);
    }
  }

 private:
  struct Input {
    const rules::PortRules* rules = nullptr;
    std::vector<std::string> others;  // sources whose connections no rule selects
    std::string id;
  };
  struct Component {
    std::map<std::string, Input> inputs;
    std::map<std::string, std::string> outputs;  // ids
    std::string id;
  };

  Input& input(const std::string& port) { return components_[component_of(port)].inputs[port]; }
  std::string& output(const std::string& port) {
    return components_[component_of(port)].outputs[port];
  }

  [[nodiscard]] bool is_active(const std::string& source) const {
    return situation_ != nullptr && situation_->active.contains(source);
  }
  [[nodiscard]] bool wins(const std::string& source, const std::string& port) const {
    if (situation_ == nullptr) return false;
    const auto winner = situation_->winners.find(port);
    return winner != situation_->winners.end() && winner->second == source;
  }

  static std::string cell(const std::string& id, const char* align, const char* fill,
                          const std::string& content) {
    return "<TR><TD PORT=\"" + id + "\" ALIGN=\"" + align + "\" BGCOLOR=\"" + fill + "\">" +
           content + "</TD></TR>";
  }

  static std::string lines(const std::string& text) {
    // Each line to the left, which a table's cell does for breaks that say so.
    std::string result = html(text);
    static constexpr std::string_view kBreak = "<BR/>";
    const bool is_broken = result.find(kBreak) != std::string::npos;
    for (std::size_t at = result.find(kBreak); at != std::string::npos;
         at = result.find(kBreak, at + 1)) {
      result.replace(at, kBreak.size(), "<BR ALIGN=\"LEFT\"/>");
    }
    return is_broken ? result + "<BR ALIGN=\"LEFT\"/>" : result;
  }

  [[nodiscard]] std::string rule_row(const rules::ConnectionRule& rule, const std::string& port,
                                     const std::string& id) const {
    const bool winning = wins(rule.source, port);
    const bool losing = !winning && is_active(rule.source);
    const std::string mark = situation_ == nullptr ? "" : winning ? "▶ " : losing ? "✕ " : "○ ";
    return cell(id, "LEFT",
                winning  ? colour::kPaleWins
                : losing ? colour::kPaleOverridden
                         : colour::kPaper,
                "<FONT POINT-SIZE=\"9\">" + lines(mark + broken(to_string(rule))) + "</FONT>");
  }

  [[nodiscard]] std::string input_rows(const std::string& port, const Input& in) const {
    std::string rows;
    if (in.rules == nullptr) return cell(in.id, "LEFT", colour::kPaper, html("▸ " + port));
    rows += cell(in.id, "LEFT", colour::kShade,
                 html("▸ " + port) + "  <FONT POINT-SIZE=\"9\"><I>arbiter" +
                     (in.rules->first_wins ? ", the first that holds" : "") + "</I></FONT>");
    for (std::size_t i = 0; i < in.rules->rules.size(); ++i) {
      rows += rule_row(in.rules->rules[i], port, in.id + "r" + std::to_string(i));
    }
    for (std::size_t i = 0; i < in.others.size(); ++i) {
      rows += cell(in.id + "n" + std::to_string(i), "LEFT", colour::kPaper,
                   "<FONT POINT-SIZE=\"9\"><I>" + html(in.others[i] + ": no rule, never delivers") +
                       "</I></FONT>");
    }
    return rows;
  }

  void draw_component(const std::string& name, const Component& component) {
    std::string rows = R"(<TR><TD BGCOLOR=")" + std::string(colour::kPlain) +
                       R"("><FONT COLOR="white"><B>)" + html(name) + "</B></FONT></TD></TR>";
    for (const auto& [port, in] : component.inputs) rows += input_rows(port, in);
    for (const auto& [port, id] : component.outputs) {
      const std::string mark = situation_ == nullptr ? "" : is_active(port) ? "● " : "○ ";
      rows += cell(id, "RIGHT", is_active(port) ? colour::kPaleActive : colour::kPaper,
                   html(mark + port + " ▸"));
    }
    out_.statement(component.id, {{"tooltip", quoted(name)},
                                  {"label",
                                   "<<TABLE BORDER=\"0\" CELLBORDER=\"1\" CELLSPACING=\"0\" "
                                   "CELLPADDING=\"3\">" +
                                       rows + "</TABLE>>"}});
  }

  [[nodiscard]] std::string arrow(const std::string& source, const std::string& inlet) const {
    const Component& component = components_.at(component_of(source));
    return component.id + ":" + component.outputs.at(source) + ":e -> " + inlet;
  }

  void draw_edges(const std::string& component, const std::string& port, const Input& in) {
    const auto inlet = [&](const std::string& id) { return component + ":" + id + ":w"; };
    std::set<std::string> sensed;
    std::set<const rules::Expression*> seen;
    std::set<std::string> connected(in.others.begin(), in.others.end());
    if (in.rules != nullptr) {
      for (std::size_t i = 0; i < in.rules->rules.size(); ++i) {
        const rules::ConnectionRule& rule = in.rules->rules[i];
        connected.insert(rule.source);
        rules::add_sources_of(*rule.condition, sensed, seen);
        draw_selected(rule, port, inlet(in.id + "r" + std::to_string(i)));
      }
    }
    for (std::size_t i = 0; i < in.others.size(); ++i) {
      const bool arbitrated = in.rules != nullptr;
      out_.statement(
          arrow(in.others[i], inlet(arbitrated ? in.id + "n" + std::to_string(i) : in.id)),
          {{"color", quoted(colour::kSilent)},
           {"style", arbitrated ? "dotted" : ""},
           {"tooltip", quoted(in.others[i] + " → " + port +
                              (arbitrated ? "\nno rule selects it" : "\nnot arbitrated"))}});
    }
    for (const std::string& source : sensed) {
      if (connected.contains(source)) continue;
      std::string tooltip = source + " is sensed at ";
      tooltip += port;
      out_.statement(arrow(source, inlet(in.id)), {{"color", quoted(colour::kSensed)},
                                                   {"style", "dashed"},
                                                   {"arrowhead", "odot"},
                                                   {"penwidth", is_active(source) ? "2.5" : "1"},
                                                   {"tooltip", quoted(tooltip)}});
    }
  }

  void draw_selected(const rules::ConnectionRule& rule, const std::string& port,
                     const std::string& inlet) {
    const bool winning = wins(rule.source, port);
    const bool losing = !winning && is_active(rule.source);
    const char* const hue = situation_ == nullptr ? colour::kPlain
                            : winning             ? colour::kWins
                            : losing              ? colour::kOverridden
                                                  : colour::kSilent;
    out_.statement(arrow(rule.source, inlet),
                   {{"color", quoted(hue)},
                    {"penwidth", winning  ? "3"
                                 : losing ? "1.5"
                                          : "1"},
                    {"style", losing ? "dashed" : ""},
                    {"tooltip", quoted(rule.source + " → " + port +
                                       (rule.behaviour.empty() ? "" : "\n" + rule.behaviour) +
                                       "\n" + place(rule.where))}});
  }

  const rules::RuleSet& rules_;
  const Situation* situation_;
  DotWriter& out_;
  std::map<std::string, Component> components_;
};

}  // namespace

void draw_connections(const rules::LoadedModel& model, const Situation* situation, DotWriter& out) {
  ConnectionsView(model, situation, out).draw();
}

}  // namespace arbiter::drawing
