// A sample in Cyclone's receive buffers: one fragment, or a chain of them for a large one.
//
// Whoever sends on the network has made them. So nothing is believed that Cyclone does not check:
// that they leave no gap, and reach as far as they should.
#pragma once

#include <cstddef>

#include <arbiter/bytes.hpp>

struct nn_rdata;

namespace arbiter::gateway::dds {

// Copies the sample's bytes from `from` on. False: they are not all there.
[[nodiscard]] bool copy_fragments(const nn_rdata* first, std::size_t from,
                                  WritableBytes to) noexcept;

}  // namespace arbiter::gateway::dds
