// Types of ports, between what components say (arbiter/type.hpp) and what lies in segments.
#pragma once

#include <arbiter/type.hpp>

#include "shm/type_info.hpp"

namespace arbiter::detail {

shm::TypeInfo as_info(const Type& type) noexcept;

// Of one that was judged (shm::fault_of()).
Type as_type(const shm::TypeInfo& info);

}  // namespace arbiter::detail
