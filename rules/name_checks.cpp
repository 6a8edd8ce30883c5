#include "rules/name_checks.hpp"

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "rules/names.hpp"
#include "rules/similar_names.hpp"

namespace arbiter::rules {
namespace {

std::string origin_of(const NameUse& use) {
  return use.define.empty() ? "" : " (in the text of ${" + use.define + "})";
}

// The names of one kind: of sources, or of input ports. `uses` are those of the model, `all` those
// of its application, too: what stands there alone is for others to judge.
class NameCheck {
 public:
  NameCheck(const NameUses& uses, const NameUses& all, std::string element,
            const DocumentOrder& order, Diagnostics& diagnostics)
      : uses_(uses),
        all_(all),
        element_(std::move(element)),
        order_(order),
        diagnostics_(diagnostics),
        names_(names_of(all)),
        index_(names_) {}

  void warn() {
    for (const auto& [name, own] : uses_) {
      const NameUse& use = *all_.find(name);
      if (!is_suspect(name, use)) continue;
      if (const auto meant = meant_by(name, use)) warn(name, use, *meant);
    }
  }

  // Among names that nothing declares, the one that was probably to be this one.
  [[nodiscard]] std::optional<std::string> written_for(const std::string& name) const {
    for (const SimilarName& similar : index_.similar_to(name)) {
      std::string other(similar.name);
      if ((all_.find(other)->roles & kDeclared) == 0) return other;
    }
    return std::nullopt;
  }

 private:
  static std::vector<std::string_view> names_of(const NameUses& uses) {
    std::vector<std::string_view> names;
    for (const auto& [name, use] : uses) names.push_back(name);
    return names;
  }

  [[nodiscard]] bool is_suspect(const std::string& name, const NameUse& use) const {
    return uses_.find(name) != nullptr && !use.is_repeated && (use.roles & kDeclared) == 0;
  }
  // Some component is to open it; that a condition reads it promises nothing.
  static bool is_vouched_for(const NameUse& use) {
    return (use.roles & (kDeclared | kConnected)) != 0;
  }

  // Of two that stand in one place each, one is reported: the one that nothing vouches for, else
  // the one that comes later.
  [[nodiscard]] std::optional<std::string_view> meant_by(const std::string& name,
                                                         const NameUse& use) const {
    for (const SimilarName& similar : index_.similar_to(name)) {
      const std::string other_name(similar.name);
      const NameUse& other = *all_.find(other_name);
      const bool is_alone = is_vouched_for(other) && !is_vouched_for(use);
      if (similar.how != Resemblance::kClose && !is_alone) continue;
      if (is_alone || !is_suspect(other_name, other)) return similar.name;
      if (is_vouched_for(use) && !is_vouched_for(other)) continue;
      if (order_(other.where, use.where)) return similar.name;
    }
    return std::nullopt;
  }

  void warn(const std::string& name, const NameUse& use, std::string_view meant) {
    const NameUse& other = *all_.find(std::string(meant));
    diagnostics_.warning("similar-name", use.where,
                         "the name " + name + " stands only here" + origin_of(use) +
                             ", and nothing declares it; did you mean " + std::string(meant) +
                             ", as at " + describe(other.where) + origin_of(other) +
                             "? If both are right, declare this one with <" + element_ + "=\"" +
                             name + "\"/>");
  }

  const NameUses& uses_;
  const NameUses& all_;
  const std::string element_;
  const DocumentOrder& order_;
  Diagnostics& diagnostics_;
  const std::vector<std::string_view> names_;
  const NameIndex index_;
};

// Sources that some rule selects or reads.
std::set<std::string> sources_of_rules(const RuleSet& rules) {
  std::set<std::string> sources;
  std::set<const Expression*> seen;
  for (const PortRules& port : rules.ports) {
    for (const ConnectionRule& rule : port.rules) {
      sources.insert(rule.source);
      add_sources_of(*rule.condition, sources, seen);
    }
  }
  return sources;
}

void warn_of_unread(const Model& model, const RuleSet& rules, const NameCheck& names,
                    const NameUses& all, Diagnostics& diagnostics) {
  const std::set<std::string> used = sources_of_rules(rules);
  for (const SourceDeclaration& source : model.sources) {
    if (used.contains(source.name)) continue;
    const auto written = names.written_for(source.name);
    const std::string advice =
        written ? "did you mean it where " + *written + " is written, at " +
                      describe(all.find(*written)->where) + "?"
                : std::string("use it in a condition, correct its name, or remove this");
    diagnostics.warning("never-read", source.where,
                        "no rule reads or selects " + source.name +
                            ", which is declared here: its activity decides nothing; " + advice);
  }
}

}  // namespace

void check_names(const Model& model, const std::optional<Application>& application,
                 const RuleSet& rules, const DocumentOrder& order, Diagnostics& diagnostics) {
  NameUses sources = model.source_uses;
  NameUses ports = model.port_uses;
  if (application) {
    for (const Application::Link& link : application->connections) {
      sources.add({link.source, link.where}, kConnected);
      ports.add({link.port, link.where}, kConnected);
    }
  }
  NameCheck source_check(model.source_uses, sources, "source port", order, diagnostics);
  warn_of_unread(model, rules, source_check, sources, diagnostics);
  source_check.warn();
  NameCheck(model.port_uses, ports, "arbiter at", order, diagnostics).warn();
}

void note_commands_forever(const Model& model, const RuleSet& rules, const Location& whole,
                           Diagnostics& diagnostics) {
  std::map<std::string, std::vector<std::string>> ports_of;
  for (const PortRules& port : rules.ports) {
    for (const ConnectionRule& rule : port.rules) {
      const auto own = rules.timeouts.find(rule.source);
      const auto timeout = own == rules.timeouts.end() ? rules.timeout : own->second;
      if (timeout == shm::kForever) ports_of[rule.source].push_back(port.port);
    }
  }
  if (ports_of.empty()) return;
  std::map<std::string_view, const Location*> declared;
  for (const SourceDeclaration& source : model.sources) {
    if (source.timeout) declared.emplace(source.name, &source.where);
  }
  const auto note = [&](const Location& where, const std::vector<std::string>& sources,
                        const std::vector<std::string>& ports) {
    const bool one = sources.size() == 1;
    diagnostics.note(
        "forever-commands", where,
        enumerate(sources) + (one ? " commands " : " command ") + enumerate(ports) +
            (one ? ", and its T is forever: if its" : ", and their T is forever: if a") +
            " process is killed, its activity does not end, and the port does not fall back to "
            "another source by itself; give " +
            (one ? "it" : "them") +
            " a finite T, or see to it that somebody deactivates what has died (arbiter "
            "deactivate)");
  };
  std::vector<std::string> by_default;
  std::set<std::string> ports_by_default;
  for (const auto& [source, ports] : ports_of) {
    if (const auto own = declared.find(source); own != declared.end()) {
      note(*own->second, {source}, ports);
    } else {
      by_default.push_back(source);
      ports_by_default.insert(ports.begin(), ports.end());
    }
  }
  if (by_default.empty()) return;
  const Location where = model.timeout ? model.timeout->where : whole;
  note(where, by_default, {ports_by_default.begin(), ports_by_default.end()});
}

}  // namespace arbiter::rules
