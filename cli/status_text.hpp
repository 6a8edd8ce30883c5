// A status document as `arbiter status` writes it for people.
#pragma once

#include <ostream>

#include "wire/status.hpp"

namespace arbiter::cli {

// Whose daemon's it is: of this machine, or of another, whose processes and clock are others.
enum class StatusPlace { kHere, kElsewhere };

void write_status(std::ostream& out, const wire::Status& status, StatusPlace place);

}  // namespace arbiter::cli
