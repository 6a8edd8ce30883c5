#include "rules/ask/host_places.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "rules/model/expression.hpp"
#include "rules/model/hosts.hpp"
#include "rules/text/names.hpp"

namespace arbiter::rules {
namespace {

// "base and head, by the modules "armControl" (app.xml:3:5) and "spare" (app.xml:8:5)".
std::string in_words(const std::vector<std::string>& hosts,
                     const std::vector<const Module*>& modules) {
  std::vector<std::string> named;
  named.reserve(modules.size());
  for (const Module* module : modules) {
    named.push_back(quote(module->name) + " (" + describe(module->where) + ")");
  }
  return enumerate(hosts) + ", by the modules " + enumerate(named);
}

// The first that is elsewhere than those before it: with that one it went wrong.
const Location& place_of_second(const std::vector<const Module*>& modules) {
  const auto elsewhere = std::find_if(modules.begin(), modules.end(), [&](const Module* each) {
    return !each->node.empty() && each->node != modules.front()->node;
  });
  return (elsewhere == modules.end() ? modules.front() : *elsewhere)->where;
}

class Placement {
 public:
  Placement(const Application& application, Diagnostics& diagnostics)
      : hosts_(application), diagnostics_(diagnostics) {}

  // The hosts of what is called so, in byte order; reports why there are none.
  std::vector<std::string> find(const std::string& name, const Location& where, bool in_model,
                                const Subject& about) {
    std::set<std::string> found;
    const auto& modules = hosts_.modules_of(name);
    for (const Module* module : modules) {
      if (has_host(*module, name, about)) found.insert(module->node);
    }
    if (modules.empty()) report_no_module(name, where, in_model, about);
    return {found.begin(), found.end()};
  }

  [[nodiscard]] const std::vector<const Module*>& modules_of(const std::string& name) const {
    return hosts_.modules_of(name);
  }

 private:
  // Each module is reported once, at the first port that it has.
  bool has_host(const Module& module, const std::string& port, const Subject& about) {
    const auto problem = find_problem_in_host(module.node);
    if (!problem || !reported_.insert(&module).second) return !problem;
    if (module.node.empty()) {
      diagnostics_.error("no-node", module.where,
                         "the module " + quote(module.name) +
                             " has no <node>, and nothing else says on which host " + port +
                             " is; add <node>HOST</node>, with the host that it runs on",
                         about);
    } else {
      diagnostics_.error("bad-node", module.where,
                         "the <node> of the module " + quote(module.name) + ": " + *problem, about);
    }
    return false;
  }

  void report_no_module(const std::string& name, const Location& where, bool in_model,
                        const Subject& about) {
    const std::string meant = reported_names_++ < kMaxSuggestions ? hosts_.meant_by(name) : "";
    const std::string advice =
        meant.empty() ? "; add the module whose --name, <prefix> or <name> it begins with"
                      : "; did you mean " + quote(meant) + "?";
    const std::string message =
        name +
        " belongs to no module of the application that says where things run, so that its "
        "host is not known";
    if (in_model) {
      diagnostics_.error("no-host", where, message + advice, about);
    } else {
      diagnostics_.note("place-unknown", where,
                        message + ", nor whether its connection crosses the network" + advice,
                        about);
    }
  }

  const Hosts hosts_;
  Diagnostics& diagnostics_;
  std::set<const Module*> reported_;
  std::size_t reported_names_ = 0;
};

// "localhost" is whichever machine YARP's manager runs on: maybe one of the others.
void warn_of_localhost(const std::vector<Module>& modules, Diagnostics& diagnostics) {
  const Module* local = nullptr;
  const Module* other = nullptr;
  for (const Module& module : modules) {
    if (module.node.empty()) continue;
    const Module*& which = module.node == "localhost" ? local : other;
    if (which == nullptr) which = &module;
  }
  if (local == nullptr || other == nullptr) return;
  diagnostics.warning(
      "localhost-among-hosts", local->where,
      "the module " + quote(local->name) + " runs on localhost, which may be the same machine as " +
          quote(other->node) + ", and is taken for another one; write the name of the host");
}

void add(std::vector<std::string>& names, const std::string& name) {
  const auto at = std::lower_bound(names.begin(), names.end(), name);
  if (at == names.end() || *at != name) names.insert(at, name);
}

}  // namespace

SourceUses uses_of_sources(const RuleSet& rules) {
  SourceUses uses;
  // A source's own connection is where people look for it.
  for (const PortRules& port : rules.ports) {
    for (const ConnectionRule& rule : port.rules) {
      uses.try_emplace(rule.source, SourceUse{rule.where, true, {}, {}});
    }
  }
  for (const PortRules& port : rules.ports) {
    std::set<std::string> connected, read;
    std::set<const Expression*> seen;
    for (const ConnectionRule& rule : port.rules) {
      connected.insert(rule.source);
      std::set<std::string> names;
      add_sources_of(*rule.condition, names, seen);
      for (const std::string& name : names) {
        uses.try_emplace(name, SourceUse{rule.where, true, {}, {}});
        read.insert(name);
      }
    }
    for (const std::string& name : connected) uses[name].connected_to.push_back(port.port);
    for (const std::string& name : read) {
      if (!connected.contains(name)) uses[name].read_at.push_back(port.port);
    }
  }
  for (const Connection& each : rules.other_connections) {
    SourceUse& use =
        uses.try_emplace(each.source, SourceUse{each.where, false, {}, {}}).first->second;
    add(use.connected_to, each.port);
    std::erase(use.read_at, each.port);
  }
  return uses;
}

HostPlaces::HostPlaces(const RuleSet& rules, const SourceUses& uses, const Application& application,
                       const std::string& path, Diagnostics& diagnostics) {
  if (application.modules.empty()) {
    diagnostics.error("no-modules", {path, 1, 1},
                      "this application has no <module>, so that nothing says on which host a port "
                      "is; add the modules, each with a <name> and a <node>");
    return;
  }
  warn_of_localhost(application.modules, diagnostics);
  Placement placement(application, diagnostics);
  const auto place_port = [&](const std::string& port, const Location& where, bool in_model) {
    if (of_ports_.contains(port)) return;
    const Subject about{.ports = {port}};
    const auto hosts = placement.find(port, where, in_model, about);
    of_ports_.emplace(port, hosts.size() == 1 ? hosts.front() : "");
    if (hosts.size() == 1) ++counts_[hosts.front()].ports;
    if (hosts.size() < 2) return;
    const auto& modules = placement.modules_of(port);
    diagnostics.error("port-on-two-hosts", place_of_second(modules),
                      "the input port " + port + " (" + describe(where) + ") is on " +
                          std::to_string(hosts.size()) + " hosts, " + in_words(hosts, modules) +
                          ": each host would decide it by itself; open it on one host only, or "
                          "rename one of them with --name",
                      about);
  };
  for (const PortRules& port : rules.ports) place_port(port.port, port.where, true);
  for (const Connection& each : rules.other_connections) place_port(each.port, each.where, false);
  for (const auto& [source, use] : uses) {
    const Subject about{.source = source};
    auto hosts = placement.find(source, use.where, use.in_model, about);
    if (hosts.size() == 1) ++counts_[hosts.front()].sources;
    if (hosts.size() > 1) {
      const auto& modules = placement.modules_of(source);
      diagnostics.warning("source-on-two-hosts", place_of_second(modules),
                          source + " (" + describe(use.where) + ") is on " +
                              std::to_string(hosts.size()) + " hosts, " + in_words(hosts, modules) +
                              ": each of them obeys its own, and any other host the one that it "
                              "has, until that one is gone; rename one of them with --name",
                          about);
    }
    of_sources_.emplace(source, std::move(hosts));
  }
}

const std::vector<std::string>& HostPlaces::of_source(const std::string& source) const {
  static const std::vector<std::string> unknown;
  const auto found = of_sources_.find(source);
  return found == of_sources_.end() ? unknown : found->second;
}

std::string_view HostPlaces::of_port(const std::string& port) const {
  const auto found = of_ports_.find(port);
  return found == of_ports_.end() ? std::string_view() : found->second;
}

bool HostPlaces::are_apart(const std::string& source, const std::string& port) const {
  const auto& hosts = of_source(source);
  const auto host = of_port(port);
  return !host.empty() && !hosts.empty() &&
         std::find(hosts.begin(), hosts.end(), host) == hosts.end();
}

}  // namespace arbiter::rules
