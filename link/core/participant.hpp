// Who takes part in the network, as the transport knows it: a link, in one of its lives. All its
// writers are its own, and nobody else's are. What a message says of its sender anybody can write;
// this comes from the transport.
#pragma once

#include <array>
#include <cstdint>

namespace arbiter::link {

using Participant = std::array<std::uint8_t, 12>;

}  // namespace arbiter::link
