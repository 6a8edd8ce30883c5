// The answers of calls: errors that are thrown, and outcomes that are returned; and the time.
#pragma once

#include <chrono>
#include <cstdint>
#include <stdexcept>

namespace arbiter {

// A sentence that says what went wrong, and what to do if that is known. The functions that open
// nodes and ports throw it, and those whose comments say so.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A point of time by this host's CLOCK_MONOTONIC, in nanoseconds, as std::chrono::steady_clock has
// it. Clocks of other hosts, and of this one before it was started, have nothing to do with it.
using Time = std::chrono::time_point<std::chrono::steady_clock, std::chrono::nanoseconds>;

// Where an arrival began that a component passes on, as a link does with what comes from another
// host. With recordings of both hosts, you can see by it which sample became which.
struct Origin {
  // One life of the source's output port there, as the component that passes it on numbers them.
  // 0: the arrival began here.
  std::uint64_t publisher = 0;
  // The sample's sequence() there; of a signal, that of the last sample before.
  std::uint64_t sequence = 0;
};

// The outcome of one arrival (paper, section III.A), counted in input ports that are open and
// connected.
struct Outcome {
  std::uint32_t delivered = 0;  // accepted: the connection is the winner there
  std::uint32_t discarded = 0;  // another connection is, or none
  // It is the winner, but the queue is full (refuse_new); or the connection is refused, because the
  // ports' types differ or memory is short (NoticeKind::refused), and the input port is idle.
  std::uint32_t refused = 0;
  // There was no arrival: its deadline had passed. The three above are 0.
  bool late = false;
};

// The same of a sample that its publisher wants to know again when it takes it.
struct Published {
  Outcome outcome;
  std::uint64_t sequence = 0;  // its Sample::sequence(); 0: no input port was handed it
};

}  // namespace arbiter
