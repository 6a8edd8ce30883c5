// Model and application files as they were read: names not yet looked up, nothing yet derived.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "rules/model/expression.hpp"
#include "rules/model/name_uses.hpp"
#include "rules/text/diagnostic.hpp"
#include "shm/activity.hpp"

namespace arbiter::rules {

struct Condition {
  ExpressionPtr expression;
  Location where;  // of the element
};

// A behaviour's wish that a connection be selected.
struct Config {
  std::string source;
  std::string port;
  Location where;
  std::size_t order = 0;  // among all <config> and <select> of the model
};

// A behaviour or a meta-behaviour (paper, section IV.A).
struct Behaviour {
  std::string name;
  Location where;
  bool is_meta = false;
  std::vector<Config> configs;    // of a behaviour
  std::vector<Mention> children;  // of a meta-behaviour
  std::vector<Condition> conditions;
  std::vector<Mention> inhibitions;
  // Some part of it was refused, and is missing above: what seems to lack may not.
  bool is_incomplete = false;
  // Of these parts: some inhibition, some <config> or child.
  bool lacks_inhibitions = false;
  bool lacks_parts = false;
};

// A rule written by hand.
struct Select {
  std::string source;
  std::string port;
  ExpressionPtr condition;
  Location where;
  std::size_t order = 0;
};

struct Arbiter {
  std::string port;
  Location where;
  bool first_wins = false;
  bool is_incomplete = false;  // some rule of it, or what conflict= says
};

struct SourceDeclaration {
  std::string name;
  Location where;
  std::optional<shm::Nanoseconds> timeout;
};

struct Model {
  struct Timeout {
    shm::Nanoseconds value;
    Location where;
  };
  std::optional<Timeout> timeout;
  std::vector<SourceDeclaration> sources;
  std::vector<Behaviour> behaviours;  // in document order, as all lists here
  std::vector<Arbiter> arbiters;
  std::vector<Select> selects;

  NameUses source_uses;
  NameUses port_uses;  // of input ports
  // Of quantifiers in conditions: where each stands first.
  std::map<std::string, Location> patterns;

  // Names of elements that were refused as a whole. Mentions of them are no further mistakes.
  std::set<std::string> refused_names;
  // Something was refused whose name cannot even be told, so that any name may belong to it.
  bool has_unknown_gaps = false;
  // Something was refused that may have named a source, so that quantifiers may range over more.
  bool lacks_sources = false;
  // An <arbiter> was refused whose port cannot be told.
  bool lacks_arbiters = false;

  std::size_t next_order = 0;
};

struct Application {
  struct Link {
    std::string source;
    std::string port;
    Location where;
  };
  // A program that runs on a host, as far as it says so.
  struct Module {
    std::string name;
    std::string node;  // without a leading '/', in small letters; empty if there is none
    // What the names of its ports begin with: --name and <prefix>, and if it has neither, <name>.
    std::vector<std::string> prefixes;
    Location where;
  };
  std::vector<Link> connections;  // each once
  std::vector<Module> modules;    // in document order
  // What the names of its modules' ports begin with: <prefix>, <name>, and --name among their
  // parameters.
  std::vector<std::string> prefixes;
  bool is_incomplete = false;  // some connection could not be read
};

}  // namespace arbiter::rules
