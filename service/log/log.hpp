// How the daemon logs. The lines go to standard error, by way of log_sink.hpp; where that is the
// journal, as records that say what the lines are about (event.hpp).
#pragma once

#include <spdlog/spdlog.h>

namespace arbiter::service {

namespace log = spdlog;

}  // namespace arbiter::service
