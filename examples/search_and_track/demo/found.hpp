// Where a demo's parts are: beside its program in the build tree, or where they were installed.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <stdexcept>

namespace search_and_track {

[[nodiscard]] inline std::filesystem::path own_directory() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

// The first that exists. Throws if none does.
[[nodiscard]] inline std::filesystem::path first_of(
    std::initializer_list<std::filesystem::path> candidates) {
  for (const std::filesystem::path& candidate : candidates) {
    if (std::filesystem::exists(candidate)) return candidate.lexically_normal();
  }
  throw std::runtime_error("there is no " + candidates.begin()->lexically_normal().string() +
                           "; build everything first, with: ./run build");
}

}  // namespace search_and_track
