// The models of a recording, compiled for the verbs that use them.
#pragma once

#include "evidence/models.hpp"

namespace arbiter::cli {

// Progress and problems go to standard error.
evidence::Compile recording_compiler(double effort);

}  // namespace arbiter::cli
