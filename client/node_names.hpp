// What a node and its ports may be called, and how their types are told to others.
#pragma once

#include <string>
#include <string_view>

#include <arbiter/detail/cores.hpp>

#include "shm/type_info.hpp"

namespace arbiter::detail {

// Throw Error saying what a name must be.
void check_name(std::string_view name, const char* what);
void check_port_name(std::string_view name);

shm::TypeInfo type_info(const PortType& type);

}  // namespace arbiter::detail
