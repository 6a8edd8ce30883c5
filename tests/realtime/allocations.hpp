// How often this thread has asked for memory, or given some back: malloc() and its kin are counted
// (allocations.cpp), and with them operator new and delete.
#pragma once

#include <cstdint>

namespace arbiter::test {

[[nodiscard]] std::uint64_t allocations_of_this_thread();

}  // namespace arbiter::test
