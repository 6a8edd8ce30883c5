// Text in the columns of a terminal.
//
// Names come from models, components and users. What a terminal would obey, what looks like nothing
// and what it cannot show is written as an escape, so that a name takes the columns that it seems
// to take and can move, colour or hide nothing else.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "shm/activity.hpp"

namespace arbiter::top {

// What the terminal can show.
enum class Charset { kAscii, kUtf8 };

// `text` without anything that a terminal would obey. UTF-8 stays where the terminal shows it; a
// character of no width is escaped like a control character.
[[nodiscard]] std::string safe(std::string_view text, Charset charset);

// Columns of a text that is safe.
[[nodiscard]] std::size_t columns_of(std::string_view text);

// Exactly `columns` wide: padded, or cut, with a mark where it is cut.
enum class Align { kLeft, kRight };
[[nodiscard]] std::string fit(std::string_view text, std::size_t columns, Align align,
                              Charset charset);

// "40 ms", "3.2 s", "12 min", "5 h", "9 d": at most 6 columns.
[[nodiscard]] std::string span(shm::Nanoseconds time);
// The same of times that may be far below a millisecond: "640 ns", "1.6 us".
[[nodiscard]] std::string short_span(shm::Nanoseconds time);
// 0 -> "0", 0.31 -> "0.3", 0.01 -> "<0.1", 123 456 -> "123k": at most 5 columns.
[[nodiscard]] std::string rate(double per_second);

// A bar of `columns`, of which this part (0 to 1) is left.
[[nodiscard]] std::string bar(double part, std::size_t columns, Charset charset);

}  // namespace arbiter::top
