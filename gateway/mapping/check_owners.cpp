#include "gateway/mapping/check_owners.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "rules/model/hosts.hpp"
#include "rules/text/names.hpp"

namespace arbiter::gateway {
namespace {

class OwnerCheck {
 public:
  OwnerCheck(const std::vector<Mapping>& mappings, const rules::Application& application,
             rules::Diagnostics& diagnostics)
      : hosts_(application), diagnostics_(diagnostics) {
    for (const Mapping& mapping : mappings) {
      for (const Gateway& gateway : mapping.gateways) {
        for (const Entry& entry : gateway.entries) {
          for (const Port* port : entry.ports()) mapped_.emplace(port->name, port);
        }
      }
    }
  }

  void check(const rules::RuleSet& model) {
    for (const auto& [name, port] : mapped_) check_mapped(*port);
    for (const rules::PortRules& port : model.ports) {
      check_other(port.port, port.where, "takes what is sent there", {.ports = {port.port}});
      for (const rules::ConnectionRule& rule : port.rules) {
        check_other(rule.source, rule.where, "publishes there",
                    {.ports = {}, .source = rule.source});
      }
    }
  }

 private:
  using Modules = std::vector<const rules::Module*>;

  [[nodiscard]] Modules components_with(const std::string& port) const {
    Modules modules = hosts_.modules_of(port);
    std::erase_if(modules, [](const rules::Module* module) {
      return module->name.ends_with(std::string("arbiter-gateway-") + name_of(Kind::kDds)) ||
             module->name.ends_with(std::string("arbiter-gateway-") + name_of(Kind::kIceoryx));
    });
    return modules;
  }

  static std::string in_words(const Modules& modules) {
    std::vector<std::string> names;
    for (const rules::Module* module : modules) {
      names.push_back(rules::quote(module->name) + " (" + rules::describe(module->where) + ")");
    }
    return (names.size() == 1 ? "the module " : "the modules ") + rules::enumerate(names);
  }

  void check_mapped(const Port& port) {
    const Modules modules = components_with(port.name);
    if (modules.empty()) return;
    diagnostics_.warning("two-owners", port.where,
                         "the port " + port.name + " is that of " + in_words(modules) +
                             " as well, as it is called; whoever opens it first keeps the other "
                             "out: take it out of the mapping, or rename one of the two",
                         {.ports = {port.name}});
  }

  // Each once, where it first stands.
  void check_other(const std::string& name, const rules::Location& where, const char* does,
                   rules::Subject about) {
    if (mapped_.contains(name) || !known_.insert(name).second) return;
    if (!hosts_.modules_of(name).empty()) {
      check_modules(name, where, std::move(about));
      return;
    }
    const std::string meant = reported_++ < rules::kMaxSuggestions ? meant_by(name) : "";
    diagnostics_.warning(
        "no-owner", where,
        name + " is in no mapping and belongs to no module of the application, so that nobody " +
            does +
            (meant.empty() ? "; map it, or add the module whose --name, <prefix> or <name> it "
                             "begins with"
                           : "; did you mean " + rules::quote(meant) + "?"),
        std::move(about));
  }

  // On several hosts each has its own, of which check --hosts speaks.
  void check_modules(const std::string& name, const rules::Location& where, rules::Subject about) {
    const Modules modules = components_with(name);
    const bool are_on_one_host =
        std::all_of(modules.begin(), modules.end(),
                    [&](const rules::Module* each) { return each->node == modules.front()->node; });
    if (modules.size() < 2 || !are_on_one_host) return;
    diagnostics_.warning("two-owners", where,
                         "the port " + name + " is that of " + in_words(modules) +
                             ", as it is called; whoever opens it first keeps the other out: "
                             "rename one of the two with --name",
                         std::move(about));
  }

  [[nodiscard]] std::string meant_by(const std::string& name) const {
    std::vector<std::string_view> names;
    for (const auto& [port, where] : mapped_) names.push_back(port);
    if (const auto similar = rules::find_similar(name, names)) return *similar;
    return hosts_.meant_by(name);
  }

  const rules::Hosts hosts_;
  rules::Diagnostics& diagnostics_;
  std::map<std::string, const Port*> mapped_;
  std::set<std::string> known_;
  std::size_t reported_ = 0;
};

}  // namespace

void check_owners(const std::vector<Mapping>& mappings, const rules::RuleSet& model,
                  const rules::Application& application, rules::Diagnostics& diagnostics) {
  if (application.modules.empty() || application.is_incomplete) return;
  OwnerCheck(mappings, application, diagnostics).check(model);
}

std::set<std::string> ports_of(const std::vector<Mapping>& mappings, bool is_in) {
  std::set<std::string> ports;
  for (const Mapping& mapping : mappings) {
    for (const Gateway& gateway : mapping.gateways) {
      for (const Entry& entry : gateway.entries) {
        if (entry.is_in() != is_in) continue;
        for (const Port* port : entry.ports()) ports.insert(port->name);
      }
    }
  }
  return ports;
}

void check_takers(const std::vector<Mapping>& mappings, const rules::RuleSet& model,
                  rules::Diagnostics& diagnostics) {
  const std::set<std::string> taken = ports_of(mappings, false);
  for (const rules::PortRules& port : model.ports) {
    if (taken.contains(port.port)) continue;
    diagnostics.note("no-taker", port.where,
                     "no mapping takes what " + port.port +
                         " gets: if no component opens it, nobody does; to send it on, add an "
                         "<out port=\"" +
                         port.port + "\" …/>",
                     {.ports = {port.port}});
  }
}

}  // namespace arbiter::gateway
