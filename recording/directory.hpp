// The directory that a file is in: its entry is lost or kept apart from its content.
#pragma once

#include <string>

namespace arbiter::recording {

// Returns when a power cut cannot take the entries of the directory of `path`: 0, or errno.
[[nodiscard]] int sync_directory_of(const std::string& path);

// Gives a file that has been written its name, in the same directory; a power cut cannot take it
// from then on. False: there is another by that name, which stays. Throws McapError.
[[nodiscard]] bool move_to_new(const std::string& from, const std::string& to);

}  // namespace arbiter::recording
