// The models of a recording, compiled for the verbs that use them.
#pragma once

#include "cli/model_files.hpp"
#include "evidence/models.hpp"

namespace arbiter::cli {

// Progress and problems go to standard error. Throws std::runtime_error where it has errors.
Model compile_recorded(const rules::ModelTexts& texts, double effort, rules::Keep keep);
evidence::Compile recording_compiler(double effort);

}  // namespace arbiter::cli
