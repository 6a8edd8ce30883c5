// What the daemon's records in the journal (logging/journal.hpp) say: the fields of events.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "service/log/event.hpp"

namespace arbiter::service {

// How many bytes of names a record has: who closes a thousand ports at once gets no larger share of
// the log.
inline constexpr std::size_t kMaxNamesInRecord = 4096;

// A datagram of fields, each on a line: all that came from elsewhere is made printable, and has no
// line end. `event` may be null. `user`: on whose account it is written.
[[nodiscard]] std::string journal_record(std::string_view message, log::level::level_enum level,
                                         const Event* event, std::optional<uid_t> user);

}  // namespace arbiter::service
