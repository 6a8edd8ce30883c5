// What tests of links without a network say: times, and messages as their receivers have them.
#pragma once

#include <cstdint>

#include <arbiter/bytes.hpp>

#include "link/core/card_bytes.hpp"
#include "link/core/participant.hpp"
#include "shm/activity.hpp"

namespace arbiter::test {

inline constexpr shm::Nanoseconds kMs = 1'000'000;
inline constexpr shm::Nanoseconds kS = 1000 * kMs;

inline Bytes as_bytes(const link::ByteString& bytes) { return {bytes.data(), bytes.size()}; }

inline link::Participant participant(std::uint8_t number) { return {number}; }

}  // namespace arbiter::test
