// What a model is compiled to: the decision diagrams of its connections, by port.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "rules/model/rule_set.hpp"
#include "shm/activity.hpp"
#include "shm/decision_table.hpp"

namespace arbiter::rules {

// One connection's reduced, ordered decision diagram, with the connection's own source taken as
// active.
struct CompiledRule {
  std::string source;
  shm::Word kind = 0;              // table::RuleKind, but kInOrder
  std::vector<std::string> reads;  // the sources that decide, in the order of the diagram
  std::vector<bool> expected;      // kConjunction: the activity that each read must have
  struct Node {
    shm::Word position, low, high;  // as in the flat table

    friend bool operator==(const Node&, const Node&) = default;
  };
  std::vector<Node> nodes;  // kDiagram

  friend bool operator==(const CompiledRule&, const CompiledRule&) = default;
};

struct CompiledPort {
  std::string port;
  bool arbitrated = true;
  std::vector<std::string> reads;   // each source written in its rules, in byte order
  std::vector<CompiledRule> rules;  // in document order; those that no rule selects come last
  bool first_wins = false;          // conflict="first"
  // Of a port with conflict="first", whether each rule is the connection's condition alone, and the
  // first of them that holds wins. Otherwise at most one of the rules holds in any state: where
  // first_wins is set, they have in them that none before them does.
  bool in_order = false;
};

struct CompiledModel {
  shm::Nanoseconds timeout = shm::kDefaultTimeout;
  std::map<std::string, shm::Nanoseconds> timeouts;
  std::vector<std::string> sources;
  std::vector<CompiledPort> ports;          // in byte order
  std::shared_ptr<const ModelTexts> texts;  // what it was made of, as RuleSet has it

  [[nodiscard]] shm::Nanoseconds timeout_of(const std::string& source) const {
    const auto own = timeouts.find(source);
    return own == timeouts.end() ? timeout : own->second;
  }
};

}  // namespace arbiter::rules
