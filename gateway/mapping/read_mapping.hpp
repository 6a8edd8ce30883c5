// Reads a mapping: all problems of a file in one go, each with its place.
#pragma once

#include <string>

#include "gateway/mapping/mapping.hpp"
#include "gateway/mapping/read_file.hpp"
#include "rules/text/diagnostic.hpp"
#include "rules/text/text_file.hpp"

namespace arbiter::gateway {

// The result is to be used only if no error was reported. With `directory`, files that the mapping
// names (idle="file:…") are read from there; without it, they are not looked at.
Mapping read_mapping(const rules::TextFile& file, rules::Diagnostics& diagnostics,
                     const std::string* directory = nullptr,
                     const ReadFile& read_file = rules::read_bytes);

// The same of a file, and of those beside it. Throws rules::FileError.
Mapping read_mapping_file(const std::string& path, rules::Diagnostics& diagnostics,
                          const ReadFile& read_file = rules::read_bytes);

}  // namespace arbiter::gateway
