// From rules to decision diagrams, with the proof that at most one connection of a port can win.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "rules/model/rule_set.hpp"
#include "rules/prove/budget.hpp"
#include "rules/text/diagnostic.hpp"
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
  };
  std::vector<Node> nodes;  // kDiagram
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

// How large diagrams with the precedence of conflict="first" in them may get, in nodes, before a
// port's rules are decided in order instead. Larger ones would hardly decide faster, and to make
// them takes seconds.
inline constexpr std::size_t kMaxPrecedenceNodes = 4096;

struct CompiledModel {
  shm::Nanoseconds timeout = shm::kDefaultTimeout;
  std::map<std::string, shm::Nanoseconds> timeouts;
  std::vector<std::string> sources;
  std::vector<CompiledPort> ports;          // in byte order
  std::shared_ptr<const ModelTexts> texts;  // what it was made of, as RuleSet has it
};

// Proves every port and reports what fails: two connections that can both win, with a
// witness; rules that nothing satisfies; limits exceeded. To be used only if there is no error.
// Where `diagnostics` has errors already, those of reading `rules`, ports that may depend on them
// are passed over: all that can be judged is, so that all problems are told in one go.
//
// Takes at most four fifths of the budget that is left, and shares them out among the ports. What
// could not be proved within them is an error. The rest is for what is asked of the model
// afterwards: whether it is accepted does not depend on that. Throws Stopped.
CompiledModel compile(const RuleSet& rules, Diagnostics& diagnostics, Budget& budget,
                      std::size_t max_precedence_nodes = kMaxPrecedenceNodes);
// With a budget of its own.
CompiledModel compile(const RuleSet& rules, Diagnostics& diagnostics,
                      std::size_t max_precedence_nodes = kMaxPrecedenceNodes);

// The ids under which a table names sources and ports; each must be below the limits of the table.
struct TableIds {
  std::function<shm::SourceId(const std::string& source)> source;
  std::function<shm::PortId(const std::string& port)> port;
};

// How many words a table of the model can have at most, whatever the ids. compile() makes sure that
// it is within kMaxTableWords, so that what a check has accepted can be loaded.
std::size_t largest_table(const CompiledModel& model);

// The words of shm/decision_table.hpp. Throws std::length_error where kMaxTableWords is exceeded.
std::vector<shm::Word> flatten(const CompiledModel& model, const TableIds& ids);

}  // namespace arbiter::rules
