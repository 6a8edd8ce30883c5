// What was seen, and whether it is what the paper says.
#pragma once

#include <string>

#include "story.hpp"

namespace search_and_track {

[[nodiscard]] std::string name_of(Winner winner);  // its port, or "idle"
// "  4.0 s  /Gaze/pos:i  /Face/pos:o"
[[nodiscard]] std::string line_for(std::size_t receiver, const Reign& reign);
// The winners at both ports, side by side.
[[nodiscard]] std::string table_of(const Story& story);
// Whether the winners were those of the paper's model, in their order.
[[nodiscard]] bool is_as_in_the_paper(const Story& story);
[[nodiscard]] std::string verdict_on(const Story& story);

}  // namespace search_and_track
