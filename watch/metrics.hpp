// A status document as metrics, in Prometheus's text format (version 0.0.4).
//
// docs/watching.md has a row for each field of the document: its metric, or why it has none.
#pragma once

#include <string>

#include "wire/status.hpp"

namespace arbiter::watch {

// arbiter_up 1, and all that the status says.
[[nodiscard]] std::string metrics_of(const wire::Status& status);
// Where there is no daemon, or none that answers: arbiter_up 0, and nothing else, so that what was
// counted last does not pass for what is.
[[nodiscard]] std::string metrics_of_no_daemon();

}  // namespace arbiter::watch
