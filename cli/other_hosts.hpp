// What verbs say of other hosts, as the link of this host knows them.
#pragma once

#include <optional>
#include <ostream>
#include <string>

#include "wire/hosts.hpp"

namespace arbiter::cli {

// For verbs that are about this host: nothing where no link runs here, or it does not answer, which
// standard error says. Waits for a second at most.
[[nodiscard]] std::optional<wire::HostsDocument> hosts_if_linked(const std::string& instance);

// The input ports that are open on several hosts, a line for each.
void write_port_errors(std::ostream& out, const std::optional<wire::HostsDocument>& hosts);

// "0.32 ms"; "-": not measured.
[[nodiscard]] std::string round_trip_text(const std::optional<shm::Nanoseconds>& round_trip);

// "default 08056122", "no daemon", …; "differs" where it is not that of `here` (may be null).
[[nodiscard]] std::string model_text(const wire::HostStatus& host, const wire::HostStatus* here);

}  // namespace arbiter::cli
