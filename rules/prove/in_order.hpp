// How the connections of a port are decided whose rules are tried in order: conflict="first" where
// to multiply the precedence out would explode (compile_port.cpp).
//
// Each connection's walk goes through its own condition, and then through the rules before it, from
// the last to the first: these are one chain, which all share from where they enter it. So a port
// takes twice the nodes of its rules, however many connections it has.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "rules/prove/compiled_model.hpp"

namespace arbiter::rules {

struct InOrder {
  struct Entry {
    std::size_t reads = 0;                 // how many of `reads` matter to it
    shm::Word root = 0;                    // where its walk begins
    shm::Word before = shm::table::kTrue;  // where that of the rules before it does
  };
  std::vector<std::string> reads;
  std::vector<CompiledRule::Node> nodes;
  std::vector<Entry> entries;  // by rule
};

// Of a port that is in_order. Rules that nothing satisfies have no part in it.
InOrder put_in_order(const CompiledPort& port);

// How many nodes that takes.
std::size_t nodes_in_order(const CompiledPort& port);

}  // namespace arbiter::rules
