#include "cli/unmentioned.hpp"

#include <algorithm>
#include <iostream>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "cli/live.hpp"
#include "rules/names.hpp"

namespace arbiter::cli {

void warn_if_unmentioned(const std::string& instance, Direction direction,
                         const std::string& port) try {
  const bool is_output = direction == Direction::kOutput;
  const auto node = connect(is_output ? "pub-status" : "echo-status", instance);
  const nlohmann::json status = fetch_status(*node);
  std::vector<std::string_view> mentioned;
  for (const auto& each : status.at(is_output ? "sources" : "inputs")) {
    if (!each.at("mentioned").get<bool>()) continue;
    mentioned.push_back(each.at("name").get_ref<const std::string&>());
  }
  if (std::find(mentioned.begin(), mentioned.end(), port) != mentioned.end()) return;
  const std::string what = is_output ? "nothing of this is delivered" : "nothing comes";
  if (status.at("model").at("generation") == 0) {
    std::cerr << "arbiter: no model is in force, so that " << what << '\n';
    return;
  }
  std::cerr << "arbiter: the model in force does not mention " << port << ", so that " << what
            << rules::advise(port, mentioned, "`arbiter status` shows the ports that it mentions")
            << std::endl;
} catch (const Error&) {
  // It is not allowed, or the daemon has gone meanwhile.
}

}  // namespace arbiter::cli
