// Whether the daemon does not know what a node of this process has open, because the state of the
// daemon before is lost. Such a node asks again every second, in vain: only one that has nothing
// open is let in.
#pragma once

#include <optional>
#include <string_view>

#include "shm/activity.hpp"
#include "wire/status.hpp"

namespace arbiter::gateway {

// When it was turned away last; nothing: it was not, or not for long. Another daemon of the
// instance may be found, elsewhere, while the node's own is restarted: who leaves what it has open
// does not get it back.
[[nodiscard]] std::optional<shm::Nanoseconds> turned_away_at(const wire::Status& status,
                                                             std::string_view node);

}  // namespace arbiter::gateway
