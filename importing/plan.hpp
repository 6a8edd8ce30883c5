// What a multiplexer's file comes to, before it is written as a model and a mapping: an order of
// commands, of which the first that is active and not locked wins.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rules/text/diagnostic.hpp"
#include "shm/activity.hpp"

namespace arbiter::importing {

// A lock's topic, one source: it is active by what one of the two Booleans says, and ended by the
// other.
struct Lock {
  std::string name;
  std::string topic;
  bool has_heartbeat = false;    // free while `released` is active; else, while `pressed` is not
  std::string port;              // that source: "/e_stop/released:o"
  shm::Nanoseconds timeout = 0;  // its T
  std::string rank;              // "priority 100"
  std::string silence;           // "no timeout", "timeout 0.5 s"
  rules::Location where;
};

struct Command {
  std::string name;  // of the behaviour
  std::string topic;
  std::string port;
  shm::Nanoseconds timeout = 0;    // T
  std::string rank, silence;       // as of a lock
  std::string description;         // may be empty
  std::vector<std::size_t> locks;  // indices, of those that hold it back
  rules::Location where;
};

// What the multiplexer never lets through, or never asks.
struct LeftOut {
  std::string what;  // "the topic /key_vel of keyboard"
  std::string why;
  rules::Location where;
};

struct Plan {
  std::string program;  // "twist_mux"
  std::vector<std::string> files;
  std::vector<std::string> remarks;  // sentences for the top of the model
  std::string mapping_remark;        // what to do beside it
  std::string timeout_remark;        // why T is what it is
  std::vector<Lock> locks;           // that some command needs
  std::vector<Command> commands;     // the most important first
  std::vector<LeftOut> left_out;
  std::string output_port, output_topic;
  std::string type;                     // of all topics but locks
  std::string idle;                     // "zero", or empty: nothing is sent
  std::string qos;                      // of the topics that come in; empty: ROS 2's default
  std::optional<std::uint32_t> domain;  // none: that of the environment
};

}  // namespace arbiter::importing
