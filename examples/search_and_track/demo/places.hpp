// Where the programs and the model are: in the build tree or where they were installed.
#pragma once

#include <filesystem>
#include <string_view>

namespace search_and_track {

[[nodiscard]] std::filesystem::path daemon_program();
[[nodiscard]] std::filesystem::path component_program(std::string_view name);
[[nodiscard]] std::filesystem::path papers_model();

}  // namespace search_and_track
