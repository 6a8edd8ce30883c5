// How the behaviours under one parent stand to each other in a picture.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace arbiter::drawing {

// By their places among their siblings; `inhibits` as pairs {who, whom}, each once.
using Inhibitions = std::vector<std::pair<std::size_t, std::size_t>>;

// For each inhibition, whether others lead from its one end to its other. A list of priorities has
// n (n - 1) / 2 inhibitions, of which n - 1 show the order; the others are drawn faintly. None is
// taken to be so where inhibitions go in a circle, or are too many to look at.
std::vector<bool> find_detours(std::size_t siblings, const Inhibitions& inhibitions);

// Those who neither inhibit nor are inhibited, in columns, so that they do not make one endless
// row.
std::vector<std::vector<std::size_t>> arrange_loners(std::size_t siblings,
                                                     const Inhibitions& inhibitions);

}  // namespace arbiter::drawing
