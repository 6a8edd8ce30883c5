// Ctrl-C, and an orderly SIGTERM: the benchmark unwinds, so that what it has started and made goes
// with it.
#pragma once

#include <poll.h>

namespace arbiter::bench {

// Not a std::exception: who catches those, to note that a system has failed, must let this pass.
struct Interrupted {};

// From now on the two signals are remembered; they end a blocking system call.
void remember_interruptions();
// Throws Interrupted if one has come.
void throw_if_interrupted();
// As poll() with one descriptor, and throws Interrupted if one comes, be it just before it waits.
int poll_or_throw(pollfd& polled, int milliseconds);

}  // namespace arbiter::bench
