// Sources that come from other hosts, as arbiter-link describes them (docs/hosts.md).
#pragma once

#include <string>

#include "wire/status.hpp"

namespace arbiter::watch {

// The node of every arbiter-link has this name. What it has open it has imported, and does not
// export again.
inline constexpr const char* kLinkNode = "arbiter-link";

// The link has not said yet.
inline constexpr const char* kUnknownHost = "?";

// The host from which the link has this source; empty: a component of this host has it open, or
// none has; or kUnknownHost.
[[nodiscard]] std::string host_of(const wire::SourceStatus& source);

}  // namespace arbiter::watch
