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
#pragma once

#include <arbiter/bytes.hpp>
#include <arbiter/input_port.hpp>
#include <arbiter/node.hpp>
#include <arbiter/notice.hpp>
#include <arbiter/options.hpp>
#include <arbiter/output_port.hpp>
#include <arbiter/result.hpp>
