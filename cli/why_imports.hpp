// What `arbiter why` says of a port of this host about sources that come from other hosts, or came.
//
// The link's document may be half a second older than the daemon's status. Where the two do not
// agree, the status counts.
#pragma once

#include <ostream>
#include <string>

#include "cli/why_follow.hpp"
#include "watch/instance.hpp"
#include "watch/obstacles.hpp"
#include "wire/hosts.hpp"
#include "wire/status.hpp"

namespace arbiter::cli {

// Of those that nobody has open any longer, and that came from other hosts. Asks these hosts, for a
// second at most each.
[[nodiscard]] watch::Fates fates_elsewhere(const WhyOptions& options, const wire::Status& here,
                                           const wire::HostsDocument& hosts);

// From which hosts they come, how far away these are, and how old the last event is.
void write_imports_of(std::ostream& out, const std::string& port, const wire::Status& here,
                      const wire::HostsDocument& hosts, const watch::Instance& instance);

}  // namespace arbiter::cli
