// Every shared mapping lies between two pages that fault, and it is known who owns it.
#pragma once

#include <cstddef>

namespace arbiter::fuzz {

// From now on, read-only mappings of that file are of a hostile owner's memory.
void declare_hostile(int fd);
[[nodiscard]] bool is_hostile(const void* address) noexcept;
// Whether a range lies in one mapping, of whomever.
[[nodiscard]] bool is_mapped(const void* address, std::size_t size) noexcept;

}  // namespace arbiter::fuzz
