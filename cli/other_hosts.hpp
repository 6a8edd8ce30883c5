// What verbs say of other hosts, as the link of this host knows them.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "watch/instance.hpp"
#include "watch/picture.hpp"
#include "wire/hosts.hpp"
#include "wire/status.hpp"

namespace arbiter::cli {

// For verbs that are about this host: nothing where no link runs here, or it does not answer, which
// standard error says. Waits for a second at most.
[[nodiscard]] std::optional<wire::HostsDocument> hosts_if_linked(const std::string& instance);

// The status document of another host. What it says is made printable: it goes to a terminal.
// Throws wire::DocumentError.
[[nodiscard]] wire::Status read_status_of_host(const std::string& text);

// Whether other hosts are there, by such a document.
[[nodiscard]] bool has_others(const std::optional<wire::HostsDocument>& hosts);

struct OtherHost {
  std::string name;
  wire::Status status;
};
struct OtherHosts {
  std::string here;  // what this one is called; empty: no link runs here
  std::vector<OtherHost> answered;
};
// Of those that answer within `patience`, their statuses: if one does not, of none. No link takes
// no time.
[[nodiscard]] OtherHosts statuses_of_other_hosts(const std::string& instance,
                                                 std::chrono::milliseconds patience);

// Further hosts that have the port open: each decides it for its own component.
[[nodiscard]] std::vector<std::string> others_with_port(const std::string& port,
                                                        const wire::HostsDocument& hosts,
                                                        const std::string& but);

// The input ports that are open on several hosts, a line for each.
void write_port_errors(std::ostream& out, const std::optional<wire::HostsDocument>& hosts);

// "0.32 ms"; "-": not measured.
[[nodiscard]] std::string round_trip_text(const std::optional<shm::Nanoseconds>& round_trip);

// ", 3 lost, 412 withheld"; empty: there is nothing to count.
[[nodiscard]] std::string counts_text(const wire::ImportStatus& import);

// By source "0.2 s ago": since its last arrival or deactivation here; none of those that had none.
using Ages = std::map<std::string, std::string>;
[[nodiscard]] Ages ages_in(const watch::Picture& picture, const shm::DecisionMemory& memory);
// As they are now.
[[nodiscard]] Ages ages_in(const watch::Instance& instance);

// Whether nobody has the source open, and none of those who died here had it last.
[[nodiscard]] bool is_left(const wire::Status& here, const std::string& source);

// Those of the sources that the link of this host has open, a line for each: from which host, how
// far away that is, how old the last event is, and what was lost. Also those that came from a host
// and that nobody has open. What is open the daemon's status says, which `hosts` may lag behind.
void write_imports(std::ostream& out, const std::vector<std::string>& sources,
                   const wire::Status& here, const wire::HostsDocument& hosts, const Ages& ages);

// "default 08056122", "no daemon", …; "differs" where it is not that of `here` (may be null).
[[nodiscard]] std::string model_text(const wire::HostStatus& host, const wire::HostStatus* here);

}  // namespace arbiter::cli
