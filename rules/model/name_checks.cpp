#include "rules/model/name_checks.hpp"

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "rules/text/names.hpp"
#include "rules/text/similar_names.hpp"
#include "rules/text/xml.hpp"

namespace arbiter::rules {
namespace {

std::string origin_of(const NameUse& use) {
  return use.define.empty() ? "" : " (in the text of ${" + use.define + "})";
}

// ":i" or ":o", in whatever case; nothing where the name does not end so.
std::string_view end_of(std::string_view name) {
  if (name.size() < 2 || name[name.size() - 2] != ':') return {};
  const char end = name.back();
  if (end == 'o' || end == 'O') return ":o";
  return end == 'i' || end == 'I' ? ":i" : std::string_view();
}

// The names of one kind: of sources, or of input ports. `uses` are those of the model, `all` those
// of its application, too: what stands there alone is for others to judge.
class NameCheck {
 public:
  NameCheck(const NameUses& uses, const NameUses& all, std::string element,
            std::string_view wrong_end, const DocumentOrder& order, Diagnostics& diagnostics)
      : uses_(uses),
        all_(all),
        element_(std::move(element)),
        wrong_end_(wrong_end),
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

  [[nodiscard]] bool is_exhausted() const { return index_.is_exhausted(); }

  // Among names that nothing declares, the one that was probably to be this one.
  [[nodiscard]] std::optional<std::string> written_for(const std::string& name) {
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

  // What is declared was spelt with care, and what is connected at least by somebody who meant it.
  static int trust_in(const NameUse& use) {
    if ((use.roles & kDeclared) != 0) return 3;
    if ((use.roles & kConnected) != 0) return 2;
    return use.is_repeated ? 1 : 0;
  }

  // Of two that stand in one place each, one is reported: the one that nothing vouches for, else
  // the one that comes later. Of several that it may have meant, the one with most behind it, and
  // of those the last before it: what belongs together stands together.
  [[nodiscard]] std::optional<std::string_view> meant_by(const std::string& name,
                                                         const NameUse& use) {
    std::optional<std::string_view> meant;
    const NameUse* best = nullptr;
    for (const SimilarName& similar : index_.similar_to(name)) {
      const NameUse& other = *all_.find(std::string(similar.name));
      if (end_of(similar.name) == wrong_end_) continue;  // that one is to be corrected itself
      if (!is_meant_rather(similar, other, use)) continue;
      if (best != nullptr && !is_better(other, *best, use)) continue;
      meant = similar.name;
      best = &other;
    }
    return meant;
  }

  [[nodiscard]] bool is_better(const NameUse& other, const NameUse& best,
                               const NameUse& use) const {
    if (trust_in(other) != trust_in(best)) return trust_in(other) > trust_in(best);
    return order_(best.where, other.where) && order_(other.where, use.where);
  }

  [[nodiscard]] bool is_meant_rather(const SimilarName& similar, const NameUse& other,
                                     const NameUse& use) const {
    const bool is_alone = is_vouched_for(other) && !is_vouched_for(use);
    if (similar.how != Resemblance::kClose && !is_alone) return false;
    if (is_alone || !is_suspect(std::string(similar.name), other)) return true;
    if (is_vouched_for(use) && !is_vouched_for(other)) return false;
    return order_(other.where, use.where);
  }

  void warn(const std::string& name, const NameUse& use, std::string_view meant) {
    const NameUse& other = *all_.find(std::string(meant));
    if (!meant.starts_with('/')) {  // in an application; nobody may write it in a model
      diagnostics_.warning("similar-name", use.where,
                           "the name " + name + " stands only here" + origin_of(use) + "; at " +
                               describe(other.where) + " is " + std::string(meant) +
                               ", without a slash in front: put one there");
      return;
    }
    diagnostics_.warning("similar-name", use.where,
                         "the name " + name + " stands only here" + origin_of(use) +
                             ", and nothing declares it; did you mean " + std::string(meant) +
                             ", as at " + describe(other.where) + origin_of(other) +
                             "? If both are right, declare " +
                             (is_vouched_for(other) ? "this one" : "both, this one") + " with <" +
                             element_ + "=\"" + escape_xml(name) + "\"/>");
  }

  const NameUses& uses_;
  const NameUses& all_;
  const std::string element_;
  const std::string_view wrong_end_;  // of a name: ":i", or ":o"
  const DocumentOrder& order_;
  Diagnostics& diagnostics_;
  const std::vector<std::string_view> names_;
  NameIndex index_;
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

void warn_of_unread(const Model& model, const RuleSet& rules, NameCheck& names, const NameUses& all,
                    Diagnostics& diagnostics) {
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
                            ", which is declared here: its activity decides nothing; " + advice,
                        // Of a misspelt name nobody else can say that it is right.
                        {.ports = {}, .source = written ? "" : source.name});
  }
}

// Names that stand where the other end of a connection belongs. A name that is used for both counts
// as what its ending says, and as an input port if that says nothing.
class WrongEnds {
 public:
  WrongEnds(const Model& model, Diagnostics& diagnostics)
      : model_(model), diagnostics_(diagnostics) {}

  void warn() {
    for (const auto& [name, use] : model_.source_uses) {
      const NameUse* port = model_.port_uses.find(name);
      if (end_of(name) != ":i" && (port == nullptr || end_of(name) == ":o")) continue;
      warn(use,
           name + " stands here as a source" + origin_of(use) +
               (port != nullptr ? ", and as an input port at " + describe(port->where)
                                : std::string(", but is named like an input port")) +
               ": nobody publishes at an input port, so it is never active; write the output port "
               "that you meant",
           {.source = name});
    }
    for (const auto& [name, use] : model_.port_uses) {
      if (end_of(name) != ":o") continue;
      warn(use,
           name + " stands here as an input port" + origin_of(use) +
               ", but is named like an output port: nobody takes samples there, so it commands "
               "nothing; write the input port that you meant",
           {.ports = {name}});
    }
  }

 private:
  void warn(const NameUse& use, const std::string& message, Subject about) {
    diagnostics_.warning("wrong-end", use.where,
                         message + ", or exchange the names if each stands in the other's place",
                         std::move(about));
  }

  const Model& model_;
  Diagnostics& diagnostics_;
};

void warn_of_pattern(const std::string& name, const NameUse& use, Diagnostics& diagnostics) {
  if (name.find('*') == std::string::npos) return;
  diagnostics.warning("pattern-as-name", use.where,
                      name + " is the name of one port here" + origin_of(use) +
                          ": only any(…), all(…) and none(…) in conditions take patterns; write "
                          "each name that you meant");
}

}  // namespace

void check_names(const Model& model, const std::optional<Application>& application,
                 const RuleSet* rules, const Location& whole, const DocumentOrder& order,
                 Diagnostics& diagnostics) {
  NameUses sources = model.source_uses;
  NameUses ports = model.port_uses;
  if (application) {
    for (const Application::Link& link : application->connections) {
      sources.add({link.source, link.where}, kConnected);
      ports.add({link.port, link.where}, kConnected);
    }
  }
  for (const auto& [name, use] : model.source_uses) warn_of_pattern(name, use, diagnostics);
  for (const auto& [name, use] : model.port_uses) warn_of_pattern(name, use, diagnostics);
  NameCheck source_check(model.source_uses, sources, "source port", ":i", order, diagnostics);
  if (rules != nullptr) warn_of_unread(model, *rules, source_check, sources, diagnostics);
  source_check.warn();
  NameCheck port_check(model.port_uses, ports, "arbiter at", ":o", order, diagnostics);
  port_check.warn();
  WrongEnds(model, diagnostics).warn();
  if (!source_check.is_exhausted() && !port_check.is_exhausted()) return;
  diagnostics.note("left-open", whole,
                   "not all names were compared with each other: too many long ones are nearly the "
                   "same; there may be misspelt ones among them");
}

}  // namespace arbiter::rules
