#include "places.hpp"

#include <initializer_list>
#include <stdexcept>

namespace search_and_track {
namespace {

namespace fs = std::filesystem;

fs::path own_directory() { return fs::read_symlink("/proc/self/exe").parent_path(); }

fs::path first_of(std::initializer_list<fs::path> candidates) {
  for (const fs::path& candidate : candidates) {
    if (fs::exists(candidate)) return candidate.lexically_normal();
  }
  throw std::runtime_error("there is no " + candidates.begin()->lexically_normal().string() +
                           "; build everything first, with: ./run build");
}

}  // namespace

fs::path daemon_program() { return first_of({own_directory() / "arbiterd"}); }

fs::path component_program(std::string_view name) {
  return first_of({own_directory() / "search-and-track" / name,
                   own_directory() / DEMO_LIBEXEC_FROM_BIN / name});
}

fs::path papers_model() {
  constexpr const char* kFile = "search_and_track.xml";
  return first_of(
      {fs::path(DEMO_SOURCE_DIRECTORY) / kFile, own_directory() / DEMO_DATA_FROM_BIN / kFile});
}

}  // namespace search_and_track
