// What a node and its ports may be called.
#pragma once

#include <string_view>

namespace arbiter::detail {

// Throw Error saying what a name must be.
void check_name(std::string_view name, const char* what);
void check_port_name(std::string_view name);

}  // namespace arbiter::detail
