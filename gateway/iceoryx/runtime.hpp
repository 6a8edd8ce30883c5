// The names that gateways have with RouDi.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

namespace arbiter::gateway {

// Of the runtime of a gateway whose process has that id: no other's, also where one is started
// again before RouDi has noticed that its predecessor has died.
[[nodiscard]] std::string runtime_name(const std::string& gateway, int pid);
// The process whose runtime has that name; nothing: it is no gateway's.
[[nodiscard]] std::optional<pid_t> process_of(const std::string& gateway,
                                              const std::string& runtime);
// Why iceoryx cannot make files for a process, such as "/tmp is full"; empty: nothing is known of
// it.
[[nodiscard]] std::string why_no_traces();
// Removes what iceoryx leaves in /tmp of a process that was killed.
void remove_traces(const std::string& runtime);

}  // namespace arbiter::gateway
