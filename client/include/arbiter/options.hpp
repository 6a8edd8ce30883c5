// Options of nodes and ports. C++20: {.depth = 4}; C++17: member by member.
//
// Threads: options are values, read while the node or the port is made, and never afterwards.
// Errors: a value out of bounds makes that call throw an arbiter::Error that names the option and
// its bounds. The paper leaves all of this open.
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
  // Which daemon; empty: $ARBITER_INSTANCE, or "default" if that is not set.
  std::string instance{};
  // How long Node() waits for a daemon before it throws; one that is there by then has at least a
  // second to answer. Opening a port and switch_model() wait as long, but at least a second. From
  // 0 on; more than a year counts as a year.
  std::chrono::milliseconds connect_timeout{5000};
  // Called once by each Node(), opening of a port or switch_model() that has waited half a second
  // for a daemon, or for its answer, with a sentence that says for whom it waits, and how long at
  // most. Empty: the sentence goes to standard error. Runs on the waiting thread, which holds no
  // lock of the library: the callback may use the node and its ports, and is not called again if it
  // waits for the daemon itself. The time that it takes counts as waiting. An exception that it
  // throws ends the wait and leaves the waiting call, which then has opened nothing.
  std::function<void(const std::string&)> on_waiting{};
  // Called with what a component should know about its ports (notice.hpp), once for each port and
  // sentence. Empty: the sentence goes to standard error.
  // Runs on the service thread, or, if there is none, on a thread that calls service() or opens a
  // port; one call at a time, and with no lock of the library held. If there are two daemons
  // (NoticeKind::apart), it also runs inside Node(), on the thread that makes the node: it must not
  // use the node then. The callback may open and close ports of this node, but must not destroy the
  // node, nor its last port after the node. It should be quick: until it returns, this node takes
  // up no news. An exception is written to standard error, and has no other effect. Calls may come
  // until the node and all of its ports have gone. If something is known when a port is opened, the
  // call begins before the opening returns.
  std::function<void(const Notice&)> on_notice{};
  // Whether a thread of low priority takes up what the daemon announces (ports that come and go,
  // new models). Without it, call Node::service() often: until you do, this node's ports see no
  // changes.
  bool service_thread = true;
  // The processors on which that thread may run, numbered as by the kernel. Empty: those of the
  // thread that makes the node, which must then leave it some of their time: beside a thread of
  // SCHED_FIFO that never sleeps, it never runs.
  std::vector<unsigned> service_cpus{};
  // Whether all shared memory that this node uses is locked into memory as it is mapped (mlock).
  // Without it the memory is mapped before it is used, but the kernel may page it out. The limit on
  // locked memory (RLIMIT_MEMLOCK; 8 MiB on Debian) must allow 8 KiB and the model's table for the
  // node, 4 KiB for each source that the rules of its ports read, 36 KiB for each input port of its
  // own or connected to it, and for each output port of its own or connected to it 12 KiB, 8 KiB
  // for each receiver, and its samples. If it does not, Node() and the opening of ports throw an
  // arbiter::Error that names the limit, and a port at the other end that comes later is not
  // connected (`arbiter status` says why).
  bool lock_memory = false;
};

struct OutputPortOptions {
  // Untyped ports: the largest sample, in bytes.
  std::size_t max_size = 4096;
  // How many samples may be on loan at once, 1 to 64. Each costs the memory of a sample.
  std::uint32_t max_loans = 2;
  // The most memory, in bytes, that this port's samples may take up. Each sample takes a multiple
  // of 64 bytes; at least max_loans + 3 must fit. Memory is taken as input ports connect: each
  // needs its depth and its max_held. A port for which not all of its depth is left gets a smaller
  // queue, of one sample at least (`arbiter status --json` has its `depth`, and `arbiter why` says
  // so where samples are lost). One for which not even that is left is not connected; a notice to
  // both (NoticeKind::refused), `arbiter status` and `arbiter why` say so.
  std::size_t max_memory = std::size_t{1} << 30;
  // Whether the port gives way to a component that opens a port of the same name. It is for
  // programs that stand in for a component while there is none, such as arbiter-link; any program
  // may use it. When another node opens the name and does not yield itself, this port is asked to
  // go: asked_to_yield() is true from then on, and the node has a notice
  // (NoticeKind::asked_to_yield). Close the port then. The other node waits for that for 0.2 s at
  // most; if the port is still open then, it is refused, as the name is taken. Until then, no port
  // that yields gets the name. A node that yields displaces nobody: while another port has the
  // name, it is refused. The activity of the source goes on from one port to the next.
  bool yields = false;
};

// Which sample gives way when `depth` samples of one connection already wait.
enum class WhenFull : std::uint8_t {
  drop_oldest,  // the oldest of them
  refuse_new,   // the new one; publish() counts it as refused
};
inline constexpr WhenFull drop_oldest = WhenFull::drop_oldest;
inline constexpr WhenFull refuse_new = WhenFull::refuse_new;

struct InputPortOptions {
  // How many samples of each connection may wait, 1 to 1024: those of its publisher, and those that
  // its predecessors have left. Samples of predecessors give way, even with refuse_new.
  std::uint32_t depth = 8;
  WhenFull when_full = WhenFull::drop_oldest;
  // Receive all that was accepted, even if an override has come since. For loggers, not for motors.
  bool keep = false;
  // How many samples the component may hold at once, 1 to 64.
  std::uint32_t max_held = 1;
};

// The kind of port that a tap watches.
enum class TapOf : std::uint8_t {
  output,  // an output port: one source
  input,   // an input port: all sources that the model in force connects to it
};

struct TapOptions {
  TapOf of = TapOf::output;
  // How many events with samples the program may keep at once, 0 to 16. With 0 the tap gives no
  // samples, but says how large each is. The taps of one output port share what may be held: 64
  // samples, or as many as fit into 32 MiB where those are fewer; a tap that wants more than is
  // left is refused.
  std::uint32_t max_held = 1;
  // Whether the program may wait: wait_for() and fd(). A tap that only polls costs the publishers
  // less.
  bool may_wait = true;
};

}  // namespace arbiter
