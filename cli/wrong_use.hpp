// What is said of a command line that cannot be understood.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace arbiter::cli {

// With its end of line, made printable: what was typed may hold anything.
[[nodiscard]] std::string wrong_use_text(const CLI::App& app, const CLI::Error& error);

}  // namespace arbiter::cli
