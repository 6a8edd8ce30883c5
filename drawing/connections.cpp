// The paper's figure 2: components and their ports, the connections, and what each arbiter selects.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "drawing/ports.hpp"
#include "drawing/views.hpp"

namespace arbiter::drawing {
namespace {

// More arrows than this cross each other too often to be followed.
constexpr std::size_t kMaxArrows = 16;

// Of sources that a port only senses, the others share a row: inhibition across ports may make them
// as many as there are behaviours.
constexpr std::size_t kMaxSensed = 6;

// "/Gaze/pos:i" and "/Gaze" belong to "Gaze": components put their name in front of their ports'.
std::string component_of(std::string_view port) {
  if (port.size() > 1 && port.starts_with('/')) port.remove_prefix(1);  // "/" is a name, too
  const std::size_t slash = port.find('/');
  if (slash != std::string_view::npos && slash > 0) return std::string(port.substr(0, slash));
  const std::size_t colon = port.rfind(':');
  return std::string(colon == std::string_view::npos || colon == 0 ? port : port.substr(0, colon));
}

std::size_t count_rules(const Input& in) {
  return in.rules == nullptr ? 0 : in.rules->rules.size();
}

std::size_t count_arrows(const Input& in) {
  return count_rules(in) + in.others.size() + in.sensed.size();
}

// Each component once, with all its ports; one that has ports on several hosts once on each.
class ComponentsView {
 public:
  ComponentsView(const rules::RuleSet& rules, const std::map<std::string, Input>& inputs,
                 const Ports& ports, DotWriter& out)
      : ports_(ports), out_(out) {
    for (const auto& [port, in] : inputs) {
      components_[{ports_.host_of_port(port), component_of(port)}].inputs[port].in = &in;
      for (const std::string& source : in.others) add_output(source);
    }
    for (const std::string& source : rules.sources) add_output(source);
    int component = 0;
    for (auto& [key, each] : components_) {
      each.id = "c" + std::to_string(component++);
      int number = 0;
      for (auto& [port, in] : each.inputs) in.id = "i" + std::to_string(number++);
      for (auto& [port, id] : each.outputs) id = "o" + std::to_string(number++);
    }
  }

  void draw() {
    std::string box;
    for (const auto& [key, component] : components_) {
      if (key.host != box) {
        ports_.close_box(box);
        ports_.open_box(box = key.host);
      }
      draw_component(key, component);
    }
    ports_.close_box(box);
    const auto tail = [&](const std::string& source) {
      const Component& component = components_.at(key_of_source(source));
      return component.id + ":" + component.outputs.at(source);
    };
    for (const auto& [key, component] : components_) {
      for (const auto& [port, in] : component.inputs) {
        ports_.draw_arrows(*in.in, component.id, in.id, tail);
      }
    }
  }

 private:
  // In the order in which they are drawn: those in no box first.
  struct Key {
    std::string host;
    std::string name;
    friend bool operator<(const Key& a, const Key& b) {
      return std::tie(a.host, a.name) < std::tie(b.host, b.name);
    }
  };
  struct InputOfComponent {
    const Input* in = nullptr;
    std::string id;
  };
  struct Component {
    std::map<std::string, InputOfComponent> inputs;
    std::map<std::string, std::string> outputs;  // ids
    std::string id;
  };

  [[nodiscard]] Key key_of_source(const std::string& source) const {
    return {ports_.host_of_source(source), component_of(source)};
  }

  void add_output(const std::string& source) { components_[key_of_source(source)].outputs[source]; }

  void draw_component(const Key& key, const Component& component) {
    std::string rows = Ports::title_row(key.name);
    for (const auto& [port, in] : component.inputs) rows += ports_.input_rows(*in.in, in.id);
    for (const auto& [port, id] : component.outputs) rows += ports_.output_row(port, key.host, id);
    out_.statement(component.id, {{"tooltip", quoted(key.name)}, {"label", Ports::table(rows)}});
  }

  Ports ports_;
  DotWriter& out_;
  std::map<Key, Component> components_;
};

// Each input port with its own sources beside it, so that no arrow crosses another: a source stands
// at each port that it leads to. Sources of other hosts stand in the boxes of these, if few arrows
// cross the network.
class PortsView {
 public:
  PortsView(const std::map<std::string, Input>& inputs, const Ports& ports, DotWriter& out)
      : ports_(ports), out_(out) {
    std::size_t crossing = 0;
    for (const auto& [port, in] : inputs) {
      drawn_.push_back({in, {}, {}, {}});
      crossing += count_crossing(in);
    }
    has_sources_at_home_ = crossing <= kMaxArrows;
    for (std::size_t i = 0; i < drawn_.size(); ++i) prepare(drawn_[i], i);
  }

  void draw() {
    for (const auto& [host, tables] : tables_) {
      ports_.open_box(host);
      for (const Table& each : tables) {
        out_.statement(each.id,
                       {{"tooltip", quoted(each.tooltip)}, {"label", Ports::table(each.rows)}});
      }
      ports_.close_box(host);
    }
    for (std::size_t i = 0; i < drawn_.size(); ++i) draw_arrows(drawn_[i], "p" + std::to_string(i));
    hold_columns();
  }

 private:
  struct Table {
    std::string id;
    std::string tooltip;
    std::string rows;
  };
  struct Drawn {
    Input in;
    std::map<std::string, std::string> sides;              // by host: the table of its sources
    std::map<std::string, std::string> tails;              // by source: the row in such a table
    std::map<std::string, std::vector<std::string>> rest;  // by host: only sensed, in one row
  };

  static std::size_t lines_of(const Input& in) {
    return 4 + 4 * count_rules(in) + in.others.size() + std::min(in.sensed.size(), kMaxSensed);
  }

  [[nodiscard]] std::size_t count_crossing(const Input& in) const {
    const std::string host = ports_.host_of_port(in.port);
    const auto crosses = [&](const std::string& source) {
      return ports_.host_of_source(source) != host;
    };
    const auto in_list = [&](const std::vector<std::string>& sources) {
      return static_cast<std::size_t>(std::count_if(sources.begin(), sources.end(), crosses));
    };
    std::size_t count = in_list(in.others) + std::min(in_list(in.sensed), kMaxSensed);
    for (std::size_t i = 0; i < count_rules(in); ++i) {
      if (crosses(in.rules->rules[i].source)) ++count;
    }
    return count;
  }

  // The box in which a source of the port stands.
  [[nodiscard]] std::string box_of(const std::string& source, const Input& in) const {
    return has_sources_at_home_ ? ports_.host_of_source(source) : ports_.host_of_port(in.port);
  }

  // A column is about as wide as fifty lines are high. Boxes stand below each other, and have as
  // many columns.
  void hold_columns() {
    std::size_t lines = 0;
    std::map<std::string, std::vector<std::size_t>> boxes;
    for (std::size_t i = 0; i < drawn_.size(); ++i) {
      lines += lines_of(drawn_[i].in);
      boxes[ports_.host_of_port(drawn_[i].in.port)].push_back(i);
    }
    const auto columns = std::max(1.0, std::round(std::sqrt(static_cast<double>(lines) / 50)));
    for (const auto& [host, ports] : boxes) hold_columns(ports, columns);
  }

  void hold_columns(const std::vector<std::size_t>& ports, double columns) {
    double lines = 0;
    for (const std::size_t i : ports) lines += static_cast<double>(lines_of(drawn_[i].in));
    const double share = lines / columns;
    std::vector<std::vector<std::size_t>> grid(1);
    double used = 0;
    for (const std::size_t i : ports) {
      const auto height = static_cast<double>(lines_of(drawn_[i].in));
      if (!grid.back().empty() && used + height / 2 > share * static_cast<double>(grid.size())) {
        grid.emplace_back();
      }
      grid.back().push_back(i);
      used += height;
    }
    for (std::size_t column = 1; column < grid.size(); ++column) {
      for (const std::size_t left : grid[column - 1]) {
        for (const std::size_t right : grid[column]) hold(left, right);
      }
    }
  }

  void hold(std::size_t left, std::size_t right) {
    for (const auto& [host, side] : drawn_[right].sides) {
      out_.statement("p" + std::to_string(left) + " -> " + side,
                     {{"style", "invis"}, {"weight", "0"}});
    }
  }

  // Those who are active first: a live picture shows these.
  void take_rest(Drawn& drawn) const {
    Input& in = drawn.in;
    std::stable_partition(in.sensed.begin(), in.sensed.end(), [&](const std::string& source) {
      return ports_.is_active(source, in.port);
    });
    if (in.sensed.size() <= kMaxSensed) return;
    const auto rest = in.sensed.begin() + kMaxSensed - 1;
    for (auto each = rest; each != in.sensed.end(); ++each) {
      drawn.rest[box_of(*each, in)].push_back(*each);
    }
    in.sensed.erase(rest, in.sensed.end());
  }

  void prepare(Drawn& drawn, std::size_t number) {
    take_rest(drawn);
    const Input& in = drawn.in;
    std::map<std::string, std::string> rows;  // by host
    // The first one that there is has the name that it would have alone.
    const auto side_on = [&](const std::string& host) -> const std::string& {
      const std::string suffix =
          drawn.sides.empty() ? "" : "_" + std::to_string(drawn.sides.size());
      return drawn.sides.try_emplace(host, "s" + std::to_string(number) + suffix).first->second;
    };
    const auto add = [&](const std::string& source, const rules::ConnectionRule* beside) {
      if (drawn.tails.contains(source)) return;
      const std::string host = box_of(source, in);
      const std::string id = "o" + std::to_string(drawn.tails.size());
      drawn.tails[source] = side_on(host) + ":" + id;
      rows[host] += ports_.output_row(source, host, id, beside);
    };
    // In the order in which arrows end: at the port's name, at its rules, at the others.
    for (const std::string& source : in.sensed) add(source, nullptr);
    for (const auto& [host, rest] : drawn.rest) {
      static_cast<void>(side_on(host));
      rows[host] += ports_.rest_row(rest, in.port, "rest");
    }
    for (std::size_t i = 0; i < count_rules(in); ++i) {
      add(in.rules->rules[i].source, &in.rules->rules[i]);
    }
    for (const std::string& source : in.others) add(source, nullptr);
    for (const auto& [host, side] : drawn.sides) {
      tables_[host].push_back({side, "sources of " + in.port, std::move(rows[host])});
    }
    tables_[ports_.host_of_port(in.port)].push_back(
        {"p" + std::to_string(number), in.port,
         Ports::title_row(component_of(in.port)) + ports_.input_rows(in, "i")});
  }

  void draw_arrows(const Drawn& drawn, const std::string& port) {
    for (const auto& [host, rest] : drawn.rest) {
      ports_.draw_rest(rest, drawn.in.port, drawn.sides.at(host) + ":rest", port + ":i");
    }
    ports_.draw_arrows(drawn.in, port, "i",
                       [&](const std::string& source) { return drawn.tails.at(source); });
  }

  Ports ports_;
  DotWriter& out_;
  bool has_sources_at_home_ = true;
  std::vector<Drawn> drawn_;
  std::map<std::string, std::vector<Table>> tables_;  // by host
};

}  // namespace

void draw_connections(const rules::LoadedModel& model, const Situation* situation,
                      const Places* places, DotWriter& out) {
  const Ports ports(situation, places, out);
  const auto inputs = find_inputs(model.rules);
  std::size_t arrows = 0;
  for (const auto& [port, in] : inputs) arrows += count_arrows(in);
  if (arrows > kMaxArrows) {
    PortsView(inputs, ports, out).draw();
  } else {
    ComponentsView(model.rules, inputs, ports, out).draw();
  }
}

}  // namespace arbiter::drawing
