// The components and the connections between them; the winner's shine, the losers' are cut.
#pragma once

#include "canvas.hpp"
#include "story.hpp"

namespace search_and_track {

// Takes eleven rows.
void draw_diagram(Canvas& canvas, int row, const Story& story, double now);

}  // namespace search_and_track
