// Reads one file of behaviours into the model that it is a part of.
#pragma once

#include "rules/defines.hpp"
#include "rules/diagnostic.hpp"
#include "rules/model.hpp"
#include "rules/text_file.hpp"

namespace arbiter::rules {

// Appends to `model`; `defines` are those of the files before, and then also of this one. True
// where the file is an application that has its model inside, in <arbitration>.
bool read_model(const TextFile& file, Defines& defines, Model& model, Diagnostics& diagnostics);

}  // namespace arbiter::rules
