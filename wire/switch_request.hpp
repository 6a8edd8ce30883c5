// What `arbiter switch NAME --all` asks the links of all hosts (docs/hosts.md, "Switching
// everywhere"): to prepare, then to commit or to release, in the same words each time.
//
//   the number of the attempt, 16 hexadecimal digits; a line end; the model's name; and behind a
//   line end each, the hosts that are left out
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace arbiter::wire {

inline constexpr const char* kPrepareVerb = "prepare";
inline constexpr const char* kCommitVerb = "commit";
inline constexpr const char* kReleaseVerb = "release";

// Hosts that one attempt may leave out, and bytes of it all.
inline constexpr std::size_t kMaxHostsLeftOut = 32;
inline constexpr std::size_t kMaxSwitchRequest = 4096;

struct SwitchRequest {
  std::uint64_t attempt = 0;  // another for each attempt; never 0
  std::string model;
  std::vector<std::string> without;  // hosts

  friend bool operator==(const SwitchRequest&, const SwitchRequest&) = default;
};

[[nodiscard]] std::string write_switch_request(const SwitchRequest& request);
// From a stranger. Nothing: it is none.
[[nodiscard]] std::optional<SwitchRequest> read_switch_request(std::string_view text);

// What a host answers that has prepared or committed; a JSON object. One that refuses gives its
// reason instead.
struct SwitchAnswer {
  std::uint64_t generation = 0;  // of the model in force there
  std::string model;             // its name
  std::string unknown;           // not empty: why it is not known whether it has switched
  bool is_left_out = false;
};
[[nodiscard]] std::string write_switch_answer(const SwitchAnswer& answer);
// From a stranger. Throws DocumentError.
[[nodiscard]] SwitchAnswer read_switch_answer(std::string_view text);

}  // namespace arbiter::wire
