// How the behaviours under one parent stand to each other in a picture.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace arbiter::drawing {

// By their places among their siblings; pairs {who, whom}, each once.
using Inhibitions = std::vector<std::pair<std::size_t, std::size_t>>;

// A list of priorities of n has n (n - 1) / 2 inhibitions, of which n - 1 show the order. So an
// inhibition is drawn only where no others lead from its one end to its other: those are `kDirect`.
// Of the rest, `kImplied` need no arrow, for who inhibits all that its arrows lead to is marked as
// doing so; `kPast` do: it inhibits some of them and not others.
// All are direct where inhibitions go in a circle, or are too many to look at.
enum class Stroke : std::uint8_t { kDirect, kPast, kImplied };
std::vector<Stroke> find_strokes(std::size_t siblings, const Inhibitions& inhibitions);

// Those who have the same inhibitors and inhibit the same, in groups; and those of whom each
// inhibits all others, too, if they are alike in the rest. A group is drawn as one, so that an
// arrow to it stands for an arrow to each. The others are alone, and so is who may not join. In the
// order of their first members.
std::vector<std::vector<std::size_t>> find_twins(const Inhibitions& inhibitions,
                                                 const std::vector<bool>& may_join);

// Who is connected with whom by inhibitions, in the order of the first of them.
std::vector<std::vector<std::size_t>> find_pieces(std::size_t siblings,
                                                  const Inhibitions& inhibitions);

// How many inhibitions the longest way to each takes; all 0 where they go in a circle.
std::vector<std::size_t> find_ranks(std::size_t siblings, const Inhibitions& inhibitions);

// In cells as large as a behaviour.
struct Extent {
  double width = 1, height = 1;
};

// Puts pieces beside each other in rows, in their order, so that the page becomes about as wide as
// it is high.
std::vector<std::vector<std::size_t>> arrange_in_rows(const std::vector<Extent>& pieces);

// Of so many in a grid, how many stand below each other.
std::size_t height_of_grid(std::size_t count);

// Of a piece of this size, into how many columns it should be folded: a list of forty would make a
// page that is one behaviour wide.
std::size_t columns_of_fold(const Extent& piece);

}  // namespace arbiter::drawing
