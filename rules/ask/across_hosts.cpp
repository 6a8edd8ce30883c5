#include "rules/ask/across_hosts.hpp"

#include <map>
#include <set>
#include <utility>

#include "rules/ask/dependence.hpp"
#include "rules/ask/instants.hpp"
#include "rules/ask/negation_places.hpp"
#include "rules/model/polarity.hpp"
#include "rules/model/provenance.hpp"
#include "rules/text/duration.hpp"
#include "rules/text/names.hpp"

namespace arbiter::rules {
namespace {

// "/Arm/pos:i on base", or without the host where that is not known.
std::string at_host(const std::string& port, const HostPlaces& places) {
  const auto host = places.of_port(port);
  return host.empty() ? port : port + " on " + std::string(host);
}

// Names with more to each of them: a sentence holds fewer than of plain ones.
std::string first_of(std::vector<std::string> names) {
  constexpr std::size_t kMost = 3;
  if (names.size() > kMost + 1) {
    const std::string more = std::to_string(names.size() - kMost) + " more";
    names.resize(kMost);
    names.push_back(more);
  }
  return enumerate(names);
}

std::size_t count_hosts(const std::vector<std::string>& ports, const HostPlaces& places) {
  std::set<std::string_view> hosts;
  for (const std::string& port : ports) {
    if (const auto host = places.of_port(port); !host.empty()) hosts.insert(host);
  }
  return hosts.size();
}

std::string at_hosts(const std::vector<std::string>& ports, const HostPlaces& places) {
  std::vector<std::string> all;
  if (count_hosts(ports, places) == 1) {
    const auto host = places.of_port(ports.front());
    return first_of(ports) + " on " + std::string(host);
  }
  all.reserve(ports.size());
  for (const std::string& port : ports) all.push_back(at_host(port, places));
  return first_of(std::move(all));
}

// How the rules at the ports of other hosts use a source.
struct RemoteUse {
  std::vector<std::string> required_at;  // ports, as below
  std::vector<std::string> negated_at;
  std::vector<std::string> freed;  // "/Rest/pos:o at /Arm/pos:i": what waits for its silence
  // The first of these.
  const PortRules* port = nullptr;
  const ConnectionRule* rule = nullptr;
};

class AcrossHosts {
 public:
  AcrossHosts(const RuleSet& rules, const CompiledModel& model, const SourceUses& uses,
              const HostPlaces& places, Diagnostics& diagnostics, Budget& budget)
      : rules_(rules),
        uses_(uses),
        places_(places),
        negations_(rules, budget),
        diagnostics_(diagnostics),
        budget_(budget) {
    for (const CompiledPort& port : model.ports) compiled_.emplace(port.port, &port);
  }

  void find() {
    for (const PortRules& port : rules_.ports) {
      const auto compiled = compiled_.find(port.port);
      if (compiled == compiled_.end() || places_.of_port(port.port).empty()) continue;
      const Budget::Part part(budget_, budget_.left() / 4);
      Dependence dependence(*compiled->second, budget_);
      look_at(port, dependence);
    }
    for (const auto& [source, use] : uses_) {
      note_crossing(source, use);
      const auto remote = remote_.find(source);
      if (remote == remote_.end()) continue;
      const shm::Nanoseconds timeout = rules_.timeout_of(source);
      if (timeout == shm::kForever) refuse_forever(source, use, remote->second);
      warn_of_negation(source, remote->second, timeout);
    }
    note_behaviours();
  }

 private:
  // Nearly all sources are asked for as it is written. Of these the diagrams are asked.
  void look_at(const PortRules& port, Dependence& dependence) {
    Polarity before;  // with conflict="first", what lets the next rule win: no earlier one holds
    std::set<std::string> required, negated;
    const auto is_asked = [&](const ConnectionRule& rule, const std::string& source, bool active) {
      return places_.are_apart(source, port.port) && dependence.needs(rule.source, source, active);
    };
    for (const ConnectionRule& rule : port.rules) {
      Polarity polarity;
      polarity.visit(*rule.condition);
      polarity.add(rule.source, true);
      std::set<std::string> awaited = polarity.required();
      awaited.insert(before.required().begin(), before.required().end());
      for (const std::string& source : awaited) {
        if (!required.contains(source) && is_asked(rule, source, true)) required.insert(source);
      }
      std::set<std::string> silent = polarity.negated();
      silent.insert(before.negated().begin(), before.negated().end());
      for (const std::string& source : silent) {
        if (source == rule.source || !is_asked(rule, source, false)) continue;
        RemoteUse& remote = remote_[source];
        if (remote.freed.empty()) {
          remote.port = &port;
          remote.rule = &rule;
        }
        remote.freed.push_back(rule.source + " at " + port.port);
        negated.insert(source);
      }
      if (!port.first_wins) continue;
      before.visit(*rule.condition, false);
      before.add(rule.source, false);
    }
    for (const std::string& source : required) remote_[source].required_at.push_back(port.port);
    for (const std::string& source : negated) remote_[source].negated_at.push_back(port.port);
  }

  void note_crossing(const std::string& source, const SourceUse& use) {
    std::vector<std::string> connected, read, all;
    for (const std::string& port : use.connected_to) {
      if (places_.are_apart(source, port)) connected.push_back(port);
    }
    for (const std::string& port : use.read_at) {
      if (places_.are_apart(source, port)) read.push_back(port);
    }
    if (connected.empty() && read.empty()) return;
    all = connected;
    all.insert(all.end(), read.begin(), read.end());
    std::string message =
        source + " crosses the network from " + enumerate(places_.of_source(source)) + ": it is ";
    if (!connected.empty()) {
      message += "connected to " + at_hosts(connected, places_);
      if (!read.empty()) message += ", and ";
    }
    if (!read.empty()) message += "read at " + at_hosts(read, places_);
    diagnostics_.note("crosses-network", use.where, message,
                      {.ports = std::move(all), .source = source});
  }

  void refuse_forever(const std::string& source, const SourceUse& use, const RemoteUse& remote) {
    if (remote.required_at.empty()) return;
    // That is to be changed, not the connection.
    Location where;
    if (rules_.provenance) where = place_of_timeout(rules_.provenance->model, source);
    diagnostics_.error(
        "remote-forever", where.file.empty() ? use.where : where,
        source + " is on " + enumerate(places_.of_source(source)) +
            ", its T is forever, and a rule at " + at_hosts(remote.required_at, places_) +
            " requires it to be active: a cut network would not end its activity there; give it a "
            "finite T, and let it publish more often than that",
        {.ports = remote.required_at, .source = source});
  }

  void warn_of_negation(const std::string& source, const RemoteUse& remote,
                        shm::Nanoseconds timeout) {
    if (remote.negated_at.empty()) return;
    const std::string what_happens =
        timeout == shm::kForever
            ? ". What begins or ends while the network is cut is not known there: "
            : ". A cut network counts as its silence there: after " + to_string(timeout) + ", ";
    diagnostics_.warning(
        "negated-across-hosts", negations_.find(source, *remote.port, *remote.rule),
        source + " is on " + enumerate(places_.of_source(source)) + ", and a rule at " +
            at_hosts(remote.negated_at, places_) + " requires it to be inactive" + what_happens +
            first_of(remote.freed) + " may win although " + source +
            " is active; make sure that this is safe, or let the rule require an active source "
            "instead",
        {.ports = remote.negated_at, .source = source});
  }

  void note_behaviours() {
    for (const BehaviourRules& behaviour : rules_.behaviours) {
      std::set<std::string> unique;
      for (const auto& [port, rule] : behaviour.rules) unique.insert(port);
      std::vector<std::string> ports(unique.begin(), unique.end());
      if (count_hosts(ports, places_) < 2) continue;
      const std::string message = "the behaviour " + quote(behaviour.name) +
                                  " has connections to " + at_hosts(ports, places_) +
                                  ": it does not begin and end there at one instant, and while "
                                  "the network is cut it may run on one of them alone";
      diagnostics_.note("behaviour-on-two-hosts", behaviour.where, message,
                        {.ports = std::move(ports), .behaviour = behaviour.name});
    }
  }

  const RuleSet& rules_;
  const SourceUses& uses_;
  const HostPlaces& places_;
  NegationPlaces negations_;
  Diagnostics& diagnostics_;
  Budget& budget_;
  std::map<std::string, const CompiledPort*> compiled_;
  std::map<std::string, RemoteUse> remote_;
};

void warn_of_statements(const std::vector<Verdict>& verdicts, const HostPlaces& places,
                        Diagnostics& diagnostics) {
  for (const Verdict& verdict : verdicts) {
    if (verdict.kind != Verdict::Kind::kProved || count_hosts(verdict.ports, places) < 2) continue;
    diagnostics.warning("statement-on-two-hosts", verdict.where,
                        "this is true in every state, but " + at_hosts(verdict.ports, places) +
                            " are decided by hosts that do not see the same state at one instant: "
                            "it may be false while a sample crosses, and while the network is cut; "
                            "put these ports on one host, or silence this if that is harmless",
                        {.ports = verdict.ports, .statement = verdict.statement});
  }
}

}  // namespace

void find_across_hosts(const RuleSet& rules, const CompiledModel& model, const SourceUses& uses,
                       const HostPlaces& places, const std::vector<Verdict>& verdicts,
                       Diagnostics& diagnostics, Budget& budget) {
  AcrossHosts(rules, model, uses, places, diagnostics, budget).find();
  warn_of_statements(verdicts, places, diagnostics);
  find_instants(rules, model, places, diagnostics, budget);
}

}  // namespace arbiter::rules
