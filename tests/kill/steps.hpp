// The daemon's steps, at each of which it may be told to kill itself (service/kept/step.hpp).
//
// The file that ARBITER_DIE_AT names says at which: "STEP N", at the N-th passing from when it says
// so, from 0. Empty: at none.
#pragma once

namespace arbiter::service {

void at_step(const char* name) noexcept;

}  // namespace arbiter::service
