// Notices: what a component should know about its ports but cannot learn from its own calls.
//
// Threads, blocking and errors are those of the callback: NodeOptions::on_notice. Cost: off the
// data path; equal notices about a port are given once, at most 64 for each port, and at most 1024
// wait for a slow callback. The paper has no notices.
#pragma once

#include <cstdint>
#include <string>

namespace arbiter {

enum class NoticeKind : std::uint8_t {
  // The model connects the port with `peer`, but they are not connected: their types differ (the
  // text names both, with their components: type.hpp), or memory is short. While that source is
  // selected, its samples are refused, and the input port is idle.
  refused,
  // The model in force does not mention the port, or there is no model: an output port delivers
  // nothing, and nothing arrives at an input port. Or it mentions it as a port of the other kind
  // than the one that is tapped.
  unmentioned,
  // The port cannot see a source that its rules read: it delivers nothing until it can.
  blind,
  // This node and others of the instance do not see each other: they have met at two daemons; or
  // the next daemon has another clock, as in another time namespace; or it has not taken the node
  // back for two seconds, as where the state of the daemon before is lost. The text says what to
  // do. It concerns no port.
  apart,
  // Memory could not be locked (NodeOptions::lock_memory); it is used all the same.
  not_locked,
  // Another component opens a port of the name of this one, which yields
  // (OutputPortOptions::yields): close it.
  asked_to_yield,
};

struct Notice {
  NoticeKind kind;
  std::string port;  // of this node; empty: the notice is about the node
  std::string peer;  // the port at the other end, if the notice is about one
  std::string text;  // the whole notice, as a sentence for people
};

}  // namespace arbiter
