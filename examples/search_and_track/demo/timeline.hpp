// Time from left to right: when each thing was there, and who commanded each port.
#pragma once

#include "canvas.hpp"
#include "story.hpp"

namespace search_and_track {

// Takes seven rows; the last is the legend.
void draw_timeline(Canvas& canvas, int row, const Story& story, double now, double seconds);

}  // namespace search_and_track
