// What a component should know of its ports, and does not see by its own calls.
//
// Threads, blocking and errors are those of the callback: NodeOptions::on_notice. Cost: off the
// data path; notices of a port that say the same are given once, at most 64 of each port, and at
// most 1024 wait for a callback that is slow. The paper has nothing of it.
#pragma once

#include <cstdint>
#include <string>

namespace arbiter {

enum class NoticeKind : std::uint8_t {
  // The model connects the port with `peer`, and they are not connected: their types differ (the
  // text names both, with their components: type.hpp), or memory is short. While that source is
  // selected there its samples are refused, and the input
  // port is idle.
  refused,
  // The model in force does not mention the port, or there is none: nothing of an output port is
  // delivered, nothing comes to an input port.
  unmentioned,
  // The port cannot see a source that its rules read: it delivers nothing until it can.
  blind,
  // This node and others of the instance do not see each other: they have met at two daemons, or
  // the next daemon has another clock, as in another time namespace. It is about no port.
  apart,
  // Memory could not be locked (NodeOptions::lock_memory), and is used nevertheless.
  not_locked,
};

struct Notice {
  NoticeKind kind;
  std::string port;  // of this node; empty: it is about the node
  std::string peer;  // the port at the other end, where it is about one
  std::string text;  // all of it, as a sentence for people
};

}  // namespace arbiter
