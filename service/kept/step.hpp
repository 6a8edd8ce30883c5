// Where something is half done: in the memory that a successor takes up, in what clients know, or
// in files.
//
// at_step() names each such moment. Tests kill the daemon there, and let a successor make it good
// (tests/kill/daemon_steps_test.cpp). A daemon that nobody has given a hook passes its steps.
#pragma once

namespace arbiter::service {

// Of the loop's thread, as all steps are. Set before the daemon starts, by the program around it.
using StepHook = void (*)(const char* name) noexcept;
inline StepHook step_hook = nullptr;

inline void at_step(const char* name) noexcept {
  if (step_hook != nullptr) step_hook(name);
}

}  // namespace arbiter::service
