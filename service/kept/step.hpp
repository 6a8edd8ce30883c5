// Where something is half done: in the memory that a successor takes up, in what clients know, or
// in files.
//
// at_step() names each such moment. The tests kill the daemon there, and let a successor make it
// good (tests/kill/daemon_steps_test.cpp); in the daemon that ships it is nothing.
#pragma once

#ifdef ARBITER_STEPS_HEADER
#include ARBITER_STEPS_HEADER
#else
namespace arbiter::service {
constexpr void at_step(const char* /*name*/) noexcept {}
}  // namespace arbiter::service
#endif
