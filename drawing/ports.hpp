// The ends of connections: what stands in a picture for a port and its arbiter, and what the arrows
// to them look like.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "drawing/dot.hpp"
#include "drawing/places.hpp"
#include "drawing/situation.hpp"
#include "rules/model/rule_set.hpp"

namespace arbiter::drawing {

// An input port, with all that leads to it.
struct Input {
  std::string port;
  const rules::PortRules* rules = nullptr;  // null where it is not arbitrated
  std::vector<std::string> others;          // sources whose connections no rule selects
  std::vector<std::string> sensed;          // that rules read, and that have no connection to it
};

// By port, in byte order.
std::map<std::string, Input> find_inputs(const rules::RuleSet& rules);

class Ports {
 public:
  Ports(const Situation* situation, const Places* places, DotWriter& out)
      : situation_(situation), places_(places), out_(out) {}

  // As the host knows it that decides at this port.
  [[nodiscard]] bool is_active(const std::string& source, const std::string& port) const;
  // The boxes that they stand in; empty: none.
  [[nodiscard]] std::string host_of_source(const std::string& source) const;
  [[nodiscard]] std::string host_of_port(const std::string& port) const;
  // What follows is in the box of that host, until it is closed; nothing where there is none.
  void open_box(const std::string& host);
  void close_box(const std::string& host);

  // Rows of tables; arrows end at their ids: of an input port `id` itself, of its rule i "IDri", of
  // its connection without a rule "IDni".
  [[nodiscard]] std::string input_rows(const Input& in, const std::string& id) const;
  // In the box of `host`; as high as the rule's row, where it stands beside that.
  [[nodiscard]] std::string output_row(const std::string& source, const std::string& host,
                                       const std::string& id,
                                       const rules::ConnectionRule* beside = nullptr) const;
  // For several sources that are only sensed at the port, and have no rows.
  [[nodiscard]] std::string rest_row(const std::vector<std::string>& sources,
                                     const std::string& port, const std::string& id) const;
  static std::string title_row(const std::string& name);
  static std::string table(const std::string& rows);

  // One line for all of them.
  void draw_rest(const std::vector<std::string>& sources, const std::string& port,
                 const std::string& tail, const std::string& head);

  // Arrows to the input port whose rows are in `node`; `tail` names the end of a source.
  template <typename Tail>
  void draw_arrows(const Input& in, const std::string& node, const std::string& id,
                   const Tail& tail) {
    if (in.rules != nullptr) {
      for (std::size_t i = 0; i < in.rules->rules.size(); ++i) {
        const rules::ConnectionRule& rule = in.rules->rules[i];
        draw_selected(rule, in.port, arrow(tail(rule.source), node, id + "r" + std::to_string(i)));
      }
    }
    for (std::size_t i = 0; i < in.others.size(); ++i) {
      const std::string end = in.rules == nullptr ? id : id + "n" + std::to_string(i);
      draw_other(in, in.others[i], arrow(tail(in.others[i]), node, end));
    }
    for (const std::string& source : in.sensed) {
      draw_sensed(source, in.port, arrow(tail(source), node, id));
    }
  }

 private:
  static std::string arrow(const std::string& tail, const std::string& node,
                           const std::string& id) {
    return tail + ":e -> " + node + ":" + id + ":w";
  }
  // What is known on that host; null: nothing, or the picture is still.
  [[nodiscard]] const Situation* situation_on(const std::string& host) const;
  [[nodiscard]] const Situation* situation_at(const std::string& port) const;
  // Behind the name of a source in the box of `host`: " (host head)", and its note.
  [[nodiscard]] std::string text_behind(const std::string& source, const std::string& host) const;
  [[nodiscard]] bool wins(const std::string& source, const std::string& port) const;
  [[nodiscard]] std::string rule_row(const rules::ConnectionRule& rule, const std::string& port,
                                     const std::string& id) const;
  void draw_selected(const rules::ConnectionRule& rule, const std::string& port,
                     const std::string& arrow);
  void draw_other(const Input& in, const std::string& source, const std::string& arrow);
  void draw_sensed(const std::string& source, const std::string& port, const std::string& arrow);

  const Situation* situation_;
  const Places* places_;
  DotWriter& out_;
  int boxes_ = 0;  // that have been opened
};

}  // namespace arbiter::drawing
