// Recordings as CSV (RFC 4180).
#pragma once

#include <ostream>

#include "evidence/models.hpp"
#include "evidence/recorded.hpp"

namespace arbiter::evidence {

// What `arbiter simulate --trace` reads: t_ns,source,event. A source that was active when the
// recording began arrives first, when its last arrival was as far as that is known.
void write_trace(const Recorded& recorded, Models& models, std::ostream& out);

// What `arbiter simulate` writes: t_ns,source,destination,decision,winner. The decisions are the
// live ones, at input ports that were open; a source that such a port only reads has a row there,
// as in a simulation. The winners are those of the models, by the order of time.
void write_decisions(const Recorded& recorded, Models& models, std::ostream& out);

}  // namespace arbiter::evidence
