// Names that clients send, judged before they are used.
#pragma once

#include <string>
#include <string_view>

#include "wire/messages.hpp"

namespace arbiter::service {

// Logs, status and terminals show what clients call themselves and their ports: no name may break a
// line of theirs, or mislead those who read it. `whose`: as in "the port's name …". Throws
// std::runtime_error saying what is wrong.
void require_fine(std::string_view name, const char* whose);

// The port that a message is about. Throws likewise.
[[nodiscard]] std::string port_name(const wire::Message& message);

}  // namespace arbiter::service
