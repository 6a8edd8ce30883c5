#include "rules/ask/source_as_port.hpp"

#include <set>

#include "rules/text/names.hpp"

namespace arbiter::rules {
namespace {

// "connected to /Gaze/pos:i, read at /Arm/pos:i"
std::string ends_of(const SourceUse& use) {
  std::string text;
  if (!use.connected_to.empty()) text = "connected to " + enumerate(use.connected_to);
  if (use.read_at.empty()) return text;
  return text + (text.empty() ? "" : ", ") + "read at " + enumerate(use.read_at);
}

}  // namespace

std::optional<std::string> about_source_as_port(const AskedForPort& asked,
                                                std::vector<std::string_view> ports,
                                                const SourceUses& sources) {
  auto found = sources.find(asked.name);
  const bool is_one = found != sources.end();
  if (!is_one) {
    // Of a port and a source that are as near, the port: that is what was asked for.
    for (const auto& [source, use] : sources) ports.push_back(source);
    found = sources.find(find_similar(asked.name, ports).value_or(""));
    if (found == sources.end()) return {};
  }
  const auto& [source, use] = *found;
  const std::string ends = ends_of(use);
  if (ends.empty()) {
    if (!is_one) return asked.none + "; did you mean the output port " + quote(source) + "?";
    return source + " is an output port, of which the model in force reads and selects nothing";
  }
  const std::string& port = (use.connected_to.empty() ? use.read_at : use.connected_to).front();
  const std::string text =
      is_one ? source + " is an output port, " + ends
             : asked.none + "; did you mean the output port " + quote(source) + ", " + ends + "?";
  return text + (is_one ? "; give" : " Then give") +
         " the input port first: " + asked.instead(port, source);
}

std::string about_no_port(const AskedForPort& asked, const RuleSet& rules) {
  std::set<std::string_view> ports;
  for (const PortRules& port : rules.ports) ports.insert(port.port);
  for (const Connection& each : rules.other_connections) ports.insert(each.port);
  const std::vector<std::string_view> known(ports.begin(), ports.end());
  const auto text = about_source_as_port(asked, known, uses_of_sources(rules));
  return text ? *text
              : asked.none + advise(asked.name, known, "`arbiter rules` shows the input ports");
}

}  // namespace arbiter::rules
