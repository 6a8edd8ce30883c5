// The daemon's steps, at each of which it may be told to kill itself (service/kept/step.hpp).
//
// The file that ARBITER_DIE_AT names says at which: "STEP N", at the N-th passing from when it says
// so, from 0. Empty: at none.
#include <signal.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <string>

#include "service/kept/step.hpp"

namespace arbiter::service {
namespace {

void die_where_told(const char* name) noexcept {
  static unsigned passed = 0;
  const char* const path = std::getenv("ARBITER_DIE_AT");
  if (path == nullptr) return;
  std::ifstream file(path);
  std::string fatal;
  unsigned passing = 0;
  if (!(file >> fatal >> passing) || fatal != name) return;
  if (passed++ == passing) ::kill(::getpid(), SIGKILL);
}

const StepHook before_main = step_hook = die_where_told;

}  // namespace
}  // namespace arbiter::service
