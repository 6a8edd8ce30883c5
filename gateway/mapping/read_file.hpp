#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "rules/text/text_file.hpp"

namespace arbiter::gateway {

// The bytes of a file, as rules::read_bytes().
using ReadFile =
    std::function<std::string(const std::string& path, std::size_t limit, rules::Accept accept)>;

}  // namespace arbiter::gateway
