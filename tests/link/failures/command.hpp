// What is published while links fail: a sample tells whose it is, which one, and when it was made.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace arbiter::failures {

struct Command {
  std::uint32_t host = 0;    // of the publisher
  std::uint32_t life = 0;    // of the publisher: the first, or one after a kill
  std::uint64_t number = 0;  // of the samples of this life, from 1 upwards
  std::int64_t made = 0;     // immediately before it was published: CLOCK_MONOTONIC, nanoseconds
};

// Of every other host samples are so large that losers stay at home, unless a recorder of another
// host takes them.
inline constexpr std::size_t kLarge = 4096;
[[nodiscard]] inline bool is_large(unsigned host) { return host % 2 == 0; }
[[nodiscard]] inline std::size_t sample_size(unsigned host) {
  return is_large(host) ? kLarge : sizeof(Command);
}
// What a recorder takes that takes no large ones.
inline constexpr const char* kSmallOnly = "*/cmd:o";

// Of one name on several hosts at once.
inline constexpr const char* kShared = "/Shared/cmd:o";
inline std::string instance_of(unsigned host) { return "host" + std::to_string(host); }
inline std::string source_of(unsigned host) {
  return "/Host" + std::to_string(host) + (is_large(host) ? "/large:o" : "/cmd:o");
}
inline std::string hold_of(unsigned host) { return "/Hold" + std::to_string(host) + "/cmd:o"; }
inline std::string motor_of(unsigned host) { return "/Motor" + std::to_string(host) + "/cmd:i"; }

}  // namespace arbiter::failures
