// Sources that are inactive between their arrivals, because their publishers are slower than T.
#pragma once

#include "watch/port.hpp"
#include "wire/status.hpp"

namespace arbiter::watch {

// Waits, a second at most, for the next arrivals of the port's sources that have just become
// inactive although a component has them open, and notes in the look how long each took. Waits for
// nothing else. Throws as Port::look().
void add_gaps(const Port& port, Look& look, const wire::Status& status);

}  // namespace arbiter::watch
