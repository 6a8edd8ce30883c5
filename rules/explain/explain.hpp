// Why a connection wins at its port, or what keeps it out, in the terms of the model: which
// behaviour's condition, whose inhibition, where it is written.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rules/explain/sufficient_reason.hpp"
#include "rules/model/rule_set.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::rules {

// A behaviour or a meta-behaviour, as it is named in an explanation.
struct Element {
  std::string name;
  bool is_meta = false;
  Location where;
};

// Something that by itself keeps a rule, or one behaviour's part of it, from holding, whatever
// sources other than those of `because` do. The connection's own source counts as active in it, as
// in each decision on an arrival, whether it is active or not: `because` does not name it.
struct Cause {
  enum class Kind {
    kInhibited,       // `inhibitor` inhibits `of`
    kConditionFalse,  // a condition of `of`, or of a <select>
    kUnwritten,       // the rule's own text is not known; `because` is what of it does not hold
  };
  // Whether the connection's own activity makes it so: were its source alone inactive, it would not
  // be.
  enum class OwnActivity { kNoMatter, kMatters, kWillMatter };  // the last: it is not active yet

  Kind kind = Kind::kConditionFalse;
  OwnActivity own_activity = OwnActivity::kNoMatter;
  Location where;  // of the name in the <inhibition>, of the condition, of the <select>

  // Whom the inhibition names, or whose condition it is: the behaviour itself or one above it.
  std::optional<Element> of;
  std::optional<Element> inhibitor;
  // The behaviour inside `inhibitor` that has the source, where it is not the inhibitor itself.
  std::optional<Element> speaker;
  bool across_ports = false;  // the inhibitor has no connection at this port

  std::string condition;  // as it is written, quantifiers and all

  // Enough to make it so. Empty: no activity of other sources can make it otherwise; of an
  // inhibition: the connection's own source is one of those that inhibit.
  std::vector<Literal> because;
  // Further sources that are active and inhibit as well, each by itself.
  std::vector<std::string> also;
};

// What one behaviour contributes to a rule, or a <select>: the rule holds if one part does.
struct Part {
  std::optional<Element> behaviour;  // none: written by hand
  Location where;                    // of the <config> or <select>
  // None: it holds, or would if the source were active. Those that the winner alone makes so, or
  // has a part in, stand in front.
  std::vector<Cause> causes;
};

struct ConnectionExplanation {
  std::string source;
  bool is_active = false;
  bool has_rule = false;
  Location where;        // of a connection without a rule: in the application
  bool is_read = false;  // of such a one: some rule reads its source, here or at another port
  bool holds = false;
  bool wins = false;  // holds, and no earlier one does where conflict="first"
  std::vector<Part> parts;

  // Activities that are enough for it to lose: while these stay, it cannot win. Nothing where it
  // wins.
  [[nodiscard]] std::optional<std::vector<Literal>> reason() const;
  // Of a connection that holds and does not win, or would hold if it were active: the one before it
  // that holds then.
  std::optional<std::string> earlier;
  std::vector<Literal> earlier_because;  // why that one holds
};

struct PortExplanation {
  std::optional<std::string> winner;
  std::vector<ConnectionExplanation> connections;  // in document order, those without rule last
  std::vector<std::string> senses;  // sources that the rules read and that are not connected
};

class Explainer {
 public:
  // Keeps a reference. Where the rules have no provenance, parts are told without behaviours.
  explicit Explainer(const RuleSet& rules) : rules_(rules) {}

  [[nodiscard]] PortExplanation explain(const std::string& port, const IsActive& is_active) const;
  // One of its connections, for much less; nothing where the port does not have it.
  [[nodiscard]] std::optional<ConnectionExplanation> explain_connection(
      const std::string& port, const std::string& source, const IsActive& is_active) const;

  // The ports that the model names, for advice on a name that it does not.
  [[nodiscard]] std::vector<std::string> ports() const;

  // Where T of a source is written; without a file where it is the default, or not known.
  [[nodiscard]] Location place_of_timeout(const std::string& source) const;

 private:
  const RuleSet& rules_;
};

// "behaviour "Follow Face"", "meta-behaviour "Be Curious"".
std::string describe(const Element& element);

}  // namespace arbiter::rules
