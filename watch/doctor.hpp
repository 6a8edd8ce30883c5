// What is wrong around an instance: the machine's settings, the places where daemons and components
// meet, and the processes that take part. For each finding what it is, why it matters, and what to
// type to mend it.
//
// Nothing is changed. The daemon is asked for its status, once, and the link for its hosts.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "watch/machine.hpp"
#include "wire/call.hpp"
#include "wire/hosts.hpp"
#include "wire/status.hpp"

namespace arbiter::watch {

struct Finding {
  std::string code;  // docs/watching.md has them
  std::string what;
  std::string why;
  std::string mend;
};
using Findings = std::vector<Finding>;

// Limits of this process, which components that are started from here inherit; clock, processors,
// memory.
[[nodiscard]] Findings examine_machine(const Machine& machine);
// The directories where daemons and components meet, and the sockets in them.
[[nodiscard]] Findings examine_meeting_places();
// The daemon of the caller's instance: whether there is one and only one, whether it and this
// program fit together, and its status if it gives it.
[[nodiscard]] Findings examine_daemon(const wire::Caller& caller,
                                      std::optional<wire::Status>& status);
// The processes that a status names.
[[nodiscard]] Findings examine_processes(const Machine& machine, const wire::Status& status);

// Of a daemon that keeps the model of the last one, because its own files were refused.
[[nodiscard]] Findings examine_model(const wire::Status& status);

// Components that died, of whose ports the model wants one that nobody has open.
[[nodiscard]] Findings examine_deaths(const wire::Status& status);

// Ports that cannot do their work: connections that are refused, selected sources that cannot
// deliver, ports that were refused, and ports whose name is probably misspelt. A few of each.
[[nodiscard]] Findings examine_ports(const wire::Status& status);

// Sources that are inactive between their arrivals, because their publishers are slower than T. The
// daemon is asked for its memory, and activities are watched for some seconds where components have
// sources open; meanwhile `while_looking` is called often.
[[nodiscard]] Findings examine_publishers(const wire::Caller& caller, const wire::Status& status,
                                          const std::function<void()>& while_looking);

// What the link of this host waits for, and what it knows that hosts do not agree upon.
[[nodiscard]] Findings examine_hosts(const wire::HostsDocument& hosts);
// The same of the link of that instance; nothing where none runs. Waits for a second at most.
[[nodiscard]] Findings examine_link(const std::string& instance);

// All codes, in the order in which they are looked for.
[[nodiscard]] const std::vector<std::string>& finding_codes();

}  // namespace arbiter::watch
