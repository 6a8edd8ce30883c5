// report.html: the report as one page that needs no network.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace arbiter::bench {

// As JSON that may stand in a page's <script>, whatever texts it holds.
std::string script_text(const nlohmann::json& json);

// `report` is Report::json().
std::string html(const nlohmann::json& report);

}  // namespace arbiter::bench
