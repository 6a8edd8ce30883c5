// The paper's figure 2: components and their ports, the connections, and what each arbiter selects.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
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
  if (port.starts_with('/')) port.remove_prefix(1);
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

// Each component once, with all its ports.
class ComponentsView {
 public:
  ComponentsView(const rules::RuleSet& rules, const std::map<std::string, Input>& inputs,
                 const Situation* situation, DotWriter& out)
      : ports_(situation, out), out_(out) {
    for (const auto& [port, in] : inputs) {
      components_[component_of(port)].inputs[port].in = &in;
      for (const std::string& source : in.others) add_output(source);
    }
    for (const std::string& source : rules.sources) add_output(source);
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
    const auto tail = [&](const std::string& source) {
      const Component& component = components_.at(component_of(source));
      return component.id + ":" + component.outputs.at(source);
    };
    for (const auto& [name, component] : components_) {
      for (const auto& [port, in] : component.inputs) {
        ports_.draw_arrows(*in.in, component.id, in.id, tail);
      }
    }
  }

 private:
  struct InputOfComponent {
    const Input* in = nullptr;
    std::string id;
  };
  struct Component {
    std::map<std::string, InputOfComponent> inputs;
    std::map<std::string, std::string> outputs;  // ids
    std::string id;
  };

  void add_output(const std::string& source) { components_[component_of(source)].outputs[source]; }

  void draw_component(const std::string& name, const Component& component) {
    std::string rows = Ports::title_row(name);
    for (const auto& [port, in] : component.inputs) rows += ports_.input_rows(*in.in, in.id);
    for (const auto& [port, id] : component.outputs) rows += ports_.output_row(port, id);
    out_.statement(component.id, {{"tooltip", quoted(name)}, {"label", Ports::table(rows)}});
  }

  Ports ports_;
  DotWriter& out_;
  std::map<std::string, Component> components_;
};

// Each input port with its own sources beside it, so that no arrow crosses another: a source stands
// at each port that it leads to.
class PortsView {
 public:
  PortsView(const std::map<std::string, Input>& inputs, const Situation* situation, DotWriter& out)
      : ports_(situation, out), out_(out) {
    for (const auto& [port, in] : inputs) inputs_.push_back(&in);
  }

  void draw() {
    std::size_t lines = 0;
    for (const Input* in : inputs_) lines += lines_of(*in);
    // A column is about as wide as fifty lines are high.
    const auto columns = std::max(1.0, std::round(std::sqrt(static_cast<double>(lines) / 50)));
    const double share = static_cast<double>(lines) / columns;
    std::vector<std::vector<std::size_t>> grid(1);
    double used = 0;
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      const auto height = static_cast<double>(lines_of(*inputs_[i]));
      if (!grid.back().empty() && used + height / 2 > share * static_cast<double>(grid.size())) {
        grid.emplace_back();
      }
      grid.back().push_back(i);
      used += height;
    }
    for (std::size_t i = 0; i < inputs_.size(); ++i) draw_port(*inputs_[i], i);
    for (std::size_t column = 1; column < grid.size(); ++column) {
      for (const std::size_t left : grid[column - 1]) {
        for (const std::size_t right : grid[column]) hold(left, right);
      }
    }
  }

 private:
  static std::size_t lines_of(const Input& in) {
    return 4 + 4 * count_rules(in) + in.others.size() + std::min(in.sensed.size(), kMaxSensed);
  }

  void hold(std::size_t left, std::size_t right) {
    out_.statement("p" + std::to_string(left) + " -> s" + std::to_string(right),
                   {{"style", "invis"}, {"weight", "0"}});
  }

  // Those who are active first: a live picture shows these.
  std::vector<std::string> take_rest(Input& in) const {
    std::stable_partition(in.sensed.begin(), in.sensed.end(),
                          [&](const std::string& source) { return ports_.is_active(source); });
    if (in.sensed.size() <= kMaxSensed) return {};
    const auto rest = in.sensed.begin() + kMaxSensed - 1;
    std::vector<std::string> result(rest, in.sensed.end());
    in.sensed.erase(rest, in.sensed.end());
    return result;
  }

  void draw_port(Input in, std::size_t number) {
    const std::vector<std::string> rest = take_rest(in);
    const std::string port = "p" + std::to_string(number), sources = "s" + std::to_string(number);
    std::map<std::string, std::string> ids;
    std::string rows;
    const auto add = [&](const std::string& source, const rules::ConnectionRule* beside) {
      const auto [id, is_new] = ids.try_emplace(source, "o" + std::to_string(ids.size()));
      if (is_new) rows += ports_.output_row(source, id->second, beside);
    };
    // In the order in which arrows end: at the port's name, at its rules, at the others.
    for (const std::string& source : in.sensed) add(source, nullptr);
    if (!rest.empty()) rows += ports_.rest_row(rest, "rest");
    for (std::size_t i = 0; i < count_rules(in); ++i) {
      add(in.rules->rules[i].source, &in.rules->rules[i]);
    }
    for (const std::string& source : in.others) add(source, nullptr);
    out_.statement(sources,
                   {{"tooltip", quoted("sources of " + in.port)}, {"label", Ports::table(rows)}});
    out_.statement(port, {{"tooltip", quoted(in.port)},
                          {"label", Ports::table(Ports::title_row(component_of(in.port)) +
                                                 ports_.input_rows(in, "i"))}});
    if (!rest.empty()) ports_.draw_rest(rest, in.port, sources + ":rest", port + ":i");
    ports_.draw_arrows(in, port, "i",
                       [&](const std::string& source) { return sources + ":" + ids.at(source); });
  }

  Ports ports_;
  DotWriter& out_;
  std::vector<const Input*> inputs_;
};

}  // namespace

void draw_connections(const rules::LoadedModel& model, const Situation* situation, DotWriter& out) {
  const auto inputs = find_inputs(model.rules);
  std::size_t arrows = 0;
  for (const auto& [port, in] : inputs) arrows += count_arrows(in);
  if (arrows > kMaxArrows) {
    PortsView(inputs, situation, out).draw();
  } else {
    ComponentsView(model.rules, inputs, situation, out).draw();
  }
}

}  // namespace arbiter::drawing
