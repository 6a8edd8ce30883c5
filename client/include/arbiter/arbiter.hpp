// Arbiter's client interface: nodes, output ports and input ports.
//
//   arbiter::Node node("object-detector");
//   auto out = node.output_port<Position>("/Object/pos:o");
//   out.publish(Position{1, 2, 3});
//
//   auto in = node.input_port<Position>("/Arm/pos:i");
//   if (auto sample = in.take()) use(**sample);
//
// Each input port has an arbiter: at most one of the connections to the port, the winner, delivers
// (paper, section III). The model that the daemon has loaded says which one; components know
// nothing about it. docs/semantics.md says exactly what is decided, and when.
//
// C++17 or later. Threads: use a port from one thread at a time; different ports may be used by
// different threads at once. Node is safe to use from several threads. A call that may block says
// so; the others never block. Opening a port throws arbiter::Error if it fails; nothing on the data
// path throws, except for the misuse that a call names.
//
// Moved-from objects (nodes, ports, taps, samples, loans, events) may be assigned to and destroyed,
// and nothing else: no call checks for that. Objects of all kinds may be destroyed in any order,
// also as static ones.
//
// Units: bytes, and times by CLOCK_MONOTONIC: nanoseconds (arbiter::Time), or any
// std::chrono::duration. Cost: data path calls take no lock, allocate nothing and wait for nobody
// (docs/real-time.md has the exceptions); docs/benchmarks.md has what they take.
//
// Each header says the same about its own calls.
//
// Processes: a node and its ports belong to the process that made them. A forked child may do
// anything with its copies, and end in any way: nothing that it does reaches the ports. In the
// child, take(), wait_for(), fd(), publish_at(), signal_at(), deactivate_at() and all calls that
// open ports throw an arbiter::Error that says so; publish(), signal(), deactivate(), loan(),
// describe(), disarm() and latencies() do nothing, and say so on standard error once for each port;
// idle() is true, and winner() is empty. A child may read the samples that were held at the fork
// for as long as its parent holds them, and may make a Node of its own. A program that calls
// daemon(3) must therefore make its node afterwards; and so must one that closes all descriptors
// that it knows nothing of, as closefrom(3) does: without those of a node nobody can wake its
// thread, and its destructor waits for ever. When the process ends, its ports are closed, whatever
// its children do. A child of vfork() runs in its parent's memory: it may only call exec or _exit.
//
// Plugins: where g++ has compiled it, a shared object that contains the library stays loaded after
// dlclose(), and so do its static objects: let it end its nodes and ports before that.
#pragma once

#include <arbiter/bytes.hpp>
#include <arbiter/input_port.hpp>
#include <arbiter/latencies.hpp>
#include <arbiter/node.hpp>
#include <arbiter/notice.hpp>
#include <arbiter/options.hpp>
#include <arbiter/output_port.hpp>
#include <arbiter/result.hpp>
#include <arbiter/tap.hpp>
#include <arbiter/type.hpp>
#include <arbiter/winner_change.hpp>
