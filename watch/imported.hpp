// Sources that come from other hosts, as arbiter-link describes them (docs/hosts.md).
#pragma once

#include <string>

#include "wire/status.hpp"

namespace arbiter::watch {

// The host from which the link has this source; empty: a component of this host has it open, or
// none has; "?": the link has not said yet.
[[nodiscard]] std::string host_of(const wire::SourceStatus& source);

}  // namespace arbiter::watch
