// Arbiter's client interface: nodes, output ports and input ports.
//
//   arbiter::Node node("object-detector");
//   auto out = node.output_port<Position>("/Object/pos:o");
//   out.publish(Position{1, 2, 3});
//
//   auto in = node.input_port<Position>("/Arm/pos:i");
//   if (auto sample = in.take()) use(**sample);
//
// An arbiter stands at each input port: of the connections to it at most one, the winner, delivers
// (paper, section III). Which one follows from the model that the daemon has loaded; components do
// not know of it. docs/semantics.md says exactly what is decided, and when.
//
// C++17 or later. Threads: each port is used by one thread at a time, different ports by different
// threads as you like. Node is safe to use from several threads. Calls that may block say so; no
// other does. Errors are thrown as arbiter::Error when ports are opened; nothing on the data path
// throws, except for misuse that is named where it applies.
//
// Units: bytes, and times by CLOCK_MONOTONIC: nanoseconds (arbiter::Time), or any
// std::chrono::duration. Cost: data path calls take no lock, allocate nothing and wait for nobody
// (docs/real-time.md has the exceptions); docs/benchmarks.md has what they take.
//
// Each header says the same of what is its own.
//
// Processes: a node and its ports belong to the process that made them. A child that this process
// forks may do with its copies what it likes, and end as it likes: nothing of it reaches the ports.
// take(), wait_for(), fd(), publish_at() and its like, and all that opens ports throw
// arbiter::Error there, which says so; publish(), signal(), deactivate() and loan() do nothing, and
// say so on standard error, once for each port; idle() is true, and there is no winner(). A child
// may read samples that were held at the fork for as long as its parent holds them, and may make a
// Node of its own. So a program that calls daemon(3) makes its node after it. If the process ends,
// its ports are closed, whatever its children do. A child of vfork() runs in its parent's memory:
// it may call exec or _exit, and nothing else.
#pragma once

#include <arbiter/bytes.hpp>
#include <arbiter/input_port.hpp>
#include <arbiter/node.hpp>
#include <arbiter/notice.hpp>
#include <arbiter/options.hpp>
#include <arbiter/output_port.hpp>
#include <arbiter/result.hpp>
#include <arbiter/type.hpp>
