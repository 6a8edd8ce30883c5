#include "watch/process.hpp"

#include <string>

#include "watch/machine.hpp"

namespace arbiter::watch {

bool is_stopped(int pid) { return Machine().is_stopped(std::to_string(pid)); }

}  // namespace arbiter::watch
