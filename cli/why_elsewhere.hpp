// arbiter why about a port that another host decides: from that host's status and model, which the
// links bring here, explained here.
//
// Its clock is another, so the answer says what is active there, and not since when.
#pragma once

#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "cli/why_follow.hpp"
#include "wire/hosts.hpp"

namespace arbiter::cli {

// The host that has the port open, if it is not this one: nothing where this one has, or none has.
// Throws watch::WatchError where several have.
[[nodiscard]] std::optional<std::string> host_that_decides(const std::string& port,
                                                           const wire::HostsDocument& hosts);

// Further hosts that have it open, a line each. `is_open`: the host that is spoken of has, too.
void write_others_with_port(std::ostream& out, const std::string& port, bool is_open,
                            const std::vector<std::string>& others);

// Throws watch::WatchError where several machines have that name.
void require_one_host(const std::string& name, const wire::HostsDocument& hosts);

// Throws wire::CallError where that host cannot be asked, watch::WatchError where it has no such
// port.
void write_why_elsewhere(std::ostream& out, const WhyOptions& options, const std::string& host);

// --follow of a port of that host: asks twice a second who wins, and prints what has changed. Which
// change came first, and what was shorter, it does not see. Returns the exit code. Throws as
// write_why_elsewhere() at the beginning.
int follow_elsewhere(const WhyOptions& options, const std::string& host);

}  // namespace arbiter::cli
