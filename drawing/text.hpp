// Text that has to fit into a picture; the whole of it stands in tooltips.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace arbiter::drawing {

// At most so many characters, with "…" for what is left out of the middle: names that begin alike
// end in what tells them apart.
std::string shortened(std::string_view text, std::size_t characters);

// A formula in lines of about `width` characters, broken in front of " ∧ " and " ∨ ", all but the
// first set in. Of more than `max_lines`, "…" stands for the rest.
std::string in_lines(std::string_view formula, std::size_t width, std::size_t max_lines);

}  // namespace arbiter::drawing
