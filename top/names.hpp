// Names that are too long for their column: cut so that they can still be told apart.
//
// Port names differ at the end (/Navigation/planner/path:o, …/cmd_vel:o), at the beginning
// (/left/arm:i, /right/arm:i) or in the middle, so there is no one place to cut. Each name is cut
// in the first of several ways in which it looks like no other one; one drops the parts that
// all that look like it have ("…/robot_7/…/cmd_vel:o", or "…7/…/cmd_vel:o"). All names that there
// are count, not only those on the screen, so a name looks the same wherever it is shown that wide.
// A name that looks like another in all of these ways is cut in the first, and so is each of very
// many.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "top/text.hpp"

namespace arbiter::top {

class ShortNames {
 public:
  explicit ShortNames(Charset charset) : charset_(charset) {}

  // All that there are, in any order. Costs next to nothing if they are the same as before.
  void set(std::vector<std::string> names);
  // `name`, safe, at most that many columns wide.
  [[nodiscard]] std::string cut(const std::string& name, std::size_t columns);

 private:
  using Cuts = std::unordered_map<std::string, std::string>;
  [[nodiscard]] Cuts cuts_of(std::size_t columns) const;

  const Charset charset_;
  std::vector<std::string> given_;
  std::vector<std::string> names_;    // the same: safe, ascending, each once
  std::map<std::size_t, Cuts> cuts_;  // by width, of those that are wider
};

// How names are cut, the most readable first. `text` is safe and wider than that; the result is at
// most that wide.
//
// Each part between slashes but the last: "/Nav…/loc…/cmd_vel:o"; where that does not fit, as
// cut_middle().
[[nodiscard]] std::string cut_parts(const std::string& text, std::size_t columns, Charset charset);
// The beginning and the end: of the room, the beginning gets `eighths`.
[[nodiscard]] std::string cut_middle(const std::string& text, std::size_t columns,
                                     std::size_t eighths, Charset charset);
// The word that begins at or before `place`, a byte, and what follows it.
[[nodiscard]] std::string cut_around(const std::string& text, std::size_t place,
                                     std::size_t columns, Charset charset);

}  // namespace arbiter::top
