// The two kinds of pictures, each as statements within a graph.
#pragma once

#include "drawing/dot.hpp"
#include "drawing/places.hpp"
#include "drawing/situation.hpp"
#include "rules/model/load.hpp"

namespace arbiter::drawing {

void draw_behaviours(const rules::LoadedModel& model, const Situation* situation, DotWriter& out);
// With places, in boxes of hosts.
void draw_connections(const rules::LoadedModel& model, const Situation* situation,
                      const Places* places, DotWriter& out);

}  // namespace arbiter::drawing
