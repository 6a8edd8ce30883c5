// What can be chosen when nodes and ports are made. C++20: {.depth = 4}; C++17: member by member.
//
// Threads: values, which are read while the node or the port is made, and not looked at after.
// Errors: what is out of its bounds makes that throw arbiter::Error, which names the option and
// the bounds. The paper leaves all of it open.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <arbiter/notice.hpp>

namespace arbiter {

struct NodeOptions {
  // Which daemon; empty: $ARBITER_INSTANCE, else "default".
  std::string instance{};
  // How long Node() waits for a daemon before it throws; and, at least a second, the opening of a
  // port and switch_model(). Above a year it is a year.
  std::chrono::milliseconds connect_timeout{5000};
  // Called once by each Node(), opening of a port or switch_model() that has waited half a second
  // for a daemon, with a sentence that says so. Empty: the sentence goes to standard error. On the
  // thread that waits, which holds no lock of the library meanwhile: the callback may use the node
  // and its ports, and what it waits for itself it waits for in silence. The time that it takes
  // counts as waiting. What it throws ends the wait: it leaves the call that waits, which then has
  // opened nothing.
  std::function<void(const std::string&)> on_waiting{};
  // Called for what a component should know of its ports (notice.hpp), once for each port and
  // sentence. Empty: the sentence goes to standard error.
  // On the service thread; where there is none, on a thread that calls service() or opens a port.
  // And before Node() returns, on the thread that makes the node, where there are two daemons
  // (NoticeKind::apart): the callback must not use the node then.
  // One call at a time, and no lock of the library is held meanwhile: the callback may open and
  // close ports of this node. But it must not destroy the node, nor the last of its ports after it;
  // and be quick: until it returns, this node takes up nothing that is new. What it throws is
  // written to standard error, and has no other effect. It may be called until the node and all of
  // its ports have gone. Of what is known when a port is opened, the call begins before the
  // opening returns.
  std::function<void(const Notice&)> on_notice{};
  // Whether a thread of low priority takes up what the daemon announces (ports that come and go,
  // new models). Without it call Node::service() often: until you do, this node's ports do not see
  // changes.
  bool service_thread = true;
  // The processors on which that thread may run, numbered as by the kernel. Empty: those of the
  // thread that makes the node, which must then leave it some of their time: beside a thread of
  // SCHED_FIFO that never sleeps, it never runs.
  std::vector<unsigned> service_cpus{};
  // Whether all shared memory that this node uses is locked into memory as it is mapped (mlock).
  // Without it the memory is mapped before it is used, but the kernel may page it out. Takes of the
  // limit on locked memory (RLIMIT_MEMLOCK; 8 MiB on Debian): 8 KiB and the model's table for the
  // node, 4 KiB for each source that the rules of its ports read, 36 KiB for each input port, here
  // or connected to; and for each output port, here or connected to, 12 KiB, 8 KiB for each
  // receiver, and its samples. Where that is too little, Node() and the opening of ports throw
  // arbiter::Error, which names the limit. A port at the other end that comes later is then not
  // connected (`arbiter status` says why).
  bool lock_memory = false;
};

struct OutputPortOptions {
  // Untyped ports: the largest sample, in bytes.
  std::size_t max_size = 4096;
  // How many samples may be on loan at once, 1 to 64. Each costs the memory of a sample.
  std::uint32_t max_loans = 2;
  // The most memory, in bytes, that this port's samples may take up, as many as fit, each at a
  // multiple of 64 bytes; at least max_loans + 3 of them. It is taken as input ports
  // connect: each needs its depth and what it may hold. One that does not fit gets a smaller depth.
  std::size_t max_memory = std::size_t{1} << 30;
};

// What gives way when `depth` samples of one connection wait already.
enum class WhenFull : std::uint8_t {
  drop_oldest,  // the oldest of them
  refuse_new,   // the new one; the publisher is told
};
inline constexpr WhenFull drop_oldest = WhenFull::drop_oldest;
inline constexpr WhenFull refuse_new = WhenFull::refuse_new;

struct InputPortOptions {
  // How many samples of each connection may wait, 1 to 1024: those of its publisher, and those that
  // predecessors of it have left. Theirs give way, however the port is set.
  std::uint32_t depth = 8;
  WhenFull when_full = WhenFull::drop_oldest;
  // Receive all that was accepted, even if an override has come since. For loggers, not for motors.
  bool keep = false;
  // How many samples the component may hold at once, 1 to 64.
  std::uint32_t max_held = 1;
};

}  // namespace arbiter
