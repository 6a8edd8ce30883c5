// The tables of the view, made from one picture.
#pragma once

#include <string>
#include <vector>

#include "top/frame.hpp"
#include "top/line.hpp"

namespace arbiter::top {

enum class Pane { kPorts, kSources, kTakeovers };
inline constexpr int kPanes = 3;

[[nodiscard]] bool is_any_tapped(const Frame& frame);

// `filter`: only rows with that text in a name; case does not matter. "": all.
[[nodiscard]] Table ports_table(const Frame& frame, const std::string& filter, Charset charset);
[[nodiscard]] Table sources_table(const Frame& frame, const std::string& filter, Charset charset);
// `is_tapped`: no change of some ports is missed, and they say so themselves.
[[nodiscard]] Table takeovers_table(const std::vector<const Takeover*>& takeovers, bool is_tapped,
                                    const std::string& filter, Charset charset);

// "14:03:07.123", in the local time zone.
[[nodiscard]] std::string clock_text(std::chrono::system_clock::time_point time);

}  // namespace arbiter::top
