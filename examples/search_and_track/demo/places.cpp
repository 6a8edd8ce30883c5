#include "places.hpp"

#include "found.hpp"

namespace search_and_track {

namespace fs = std::filesystem;

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
