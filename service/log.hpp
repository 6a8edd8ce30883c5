// The one place that includes spdlog. Logs go to standard error: under systemd that is the journal.
#pragma once

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

namespace arbiter::service {

namespace log = spdlog;

}  // namespace arbiter::service
