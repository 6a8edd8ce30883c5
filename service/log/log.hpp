// How the daemon logs. The lines go to standard error, by way of log_sink.hpp: under systemd that
// is the journal.
#pragma once

#include <spdlog/spdlog.h>

namespace arbiter::service {

namespace log = spdlog;

}  // namespace arbiter::service
