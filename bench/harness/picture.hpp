// The targets of a report as one picture, for the README.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace arbiter::bench {

// As SVG. `report` is Report::json(), or what is kept of one: its targets, its machine, whether it
// was a quick run. Where it has a `source`, the picture says so. Throws std::runtime_error where
// it is no report.
std::string picture(const nlohmann::json& report);

}  // namespace arbiter::bench
