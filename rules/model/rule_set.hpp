// What extraction makes of a model (paper, section V): the rules of each input port's arbiter.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "rules/model/expression.hpp"
#include "rules/model/model_texts.hpp"
#include "rules/text/diagnostic.hpp"
#include "shm/activity.hpp"

namespace arbiter::rules {

struct Provenance;

// The rule that selects the connection {source, port}: `source` active, and `condition`.
struct ConnectionRule {
  std::string source;
  // Without quantifiers, and without the connection's own activity, which is implied.
  ExpressionPtr condition;
  Location where;         // of the first <config> or <select> that makes the connection
  std::string behaviour;  // the first one that configures it; empty if written by hand
};

struct PortRules {
  std::string port;
  bool first_wins = false;            // conflict="first"
  Location where;                     // of the <arbiter> element, else of the first rule
  std::vector<ConnectionRule> rules;  // in document order
  bool is_doubtful = false;           // something is wrong that these rules may depend on
};

struct Connection {
  std::string source;
  std::string port;
  Location where = {};  // in the application file; without a file where it is not known
};

// What one behaviour asks for, before the rules of several are joined.
struct BehaviourRules {
  std::string name;
  Location where;
  std::vector<std::pair<std::string, ConnectionRule>> rules;  // by port
};

// A meta-behaviour, for what is said about it; the rules have all that it means in them.
struct MetaBehaviour {
  std::string name;
  Location where;
  std::vector<std::string> children;  // behaviours and meta-behaviours
};

struct RuleSet {
  shm::Nanoseconds timeout = shm::kDefaultTimeout;   // T of all others
  std::map<std::string, shm::Nanoseconds> timeouts;  // T of sources that have their own
  std::vector<std::string> sources;                  // each one that the model names, in byte order
  std::vector<PortRules> ports;                      // the arbitrated ports, in byte order
  // From the application file: connections that no rule selects, to arbitrated ports (they never
  // deliver) and to others (they always do).
  std::vector<Connection> other_connections;
  std::vector<BehaviourRules> behaviours;  // in document order; a check asks whether each can run
  std::vector<MetaBehaviour> meta_behaviours;  // in document order
  // What it was all made of; null where that was not kept, or the rules were not read from files.
  std::shared_ptr<const Provenance> provenance;
  std::shared_ptr<const ModelTexts> texts;

  [[nodiscard]] shm::Nanoseconds timeout_of(const std::string& source) const {
    const auto own = timeouts.find(source);
    return own == timeouts.end() ? timeout : own->second;
  }
};

}  // namespace arbiter::rules
