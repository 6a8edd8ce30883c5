#include "cli/obstacles.hpp"

#include <algorithm>
#include <cstdint>
#include <fstream>

namespace arbiter::cli {
namespace {

using nlohmann::json;

// "stopped": it lives, and does not run. /proc/PID/stat: "pid (name) state …".
bool is_stopped(int pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string text;
  std::getline(file, text);
  const auto end = text.rfind(") ");
  return end != std::string::npos && end + 2 < text.size() &&
         (text[end + 2] == 'T' || text[end + 2] == 't');
}

std::string component_text(const json& port) {
  const json& component = port.at("component");
  return component.at("node").get<std::string>() + " (pid " +
         std::to_string(component.at("pid").get<int>()) + ")";
}

const json* find_named(const json& list, const char* key, const std::string& name) {
  for (const auto& each : list) {
    if (each.at(key) == name) return &each;
  }
  return nullptr;
}

}  // namespace

Obstacles::Obstacles(const json& status, const std::string& port)
    : status_(status), input_(find_named(status.at("inputs"), "name", port)) {}

std::vector<std::string> Obstacles::of_port() const {
  std::vector<std::string> result;
  if (input_ == nullptr || !input_->at("open").get<bool>()) {
    const bool is_away = input_ != nullptr && input_->at("away").get<bool>();
    result.push_back(is_away ? "its component lives, but has not come back to this daemon yet"
                             : "no component has the port open: nothing is taken");
    return result;
  }
  if (is_stopped(input_->at("component").at("pid"))) {
    result.push_back("its component " + component_text(*input_) +
                     " is stopped: its process does not run");
  }
  return result;
}

std::vector<std::string> Obstacles::of_connection(const std::string& source) const {
  std::vector<std::string> result;
  add_publisher(source, result);
  if (input_ == nullptr) return result;
  const json* found = find_named(input_->at("connections"), "source", source);
  if (found == nullptr) return result;
  const json& connection = *found;
  if (connection.at("state") == "mismatch") {
    result.push_back("not connected, the two ports do not fit: " +
                     connection.at("mismatch").get<std::string>());
    return result;
  }
  const auto count = [&](const char* key) { return connection.value(key, std::uint64_t{0}); };
  const auto say = [&](const char* key, const std::string& what) {
    if (count(key) != 0) result.push_back(std::to_string(count(key)) + what);
  };
  say("refused", " samples were refused, because the queue was full (refuse_new)");
  say("overtaken", " samples were lost to newer ones, because the component takes too slowly");
  say("dropped",
      " samples that had been accepted were dropped at the take, because it was not "
      "the winner any more then");
  // Of those that the queue had no room for, a component hears when it takes.
  const auto waiting = std::min(count("waiting"), count("depth"));
  if (waiting != 0) result.push_back(std::to_string(waiting) + " samples wait to be taken");
  if (count("accepted") != 0 && count("taken") + count("dropped") + count("overtaken") == 0) {
    result.push_back("the component has not taken any of the " + std::to_string(count("accepted")) +
                     " accepted samples");
  }
  return result;
}

void Obstacles::add_publisher(const std::string& source, std::vector<std::string>& result) const {
  const json* output = find_named(status_.at("sources"), "name", source);
  if (output == nullptr) return;
  if (!output->at("open").get<bool>()) {
    result.push_back(output->at("away").get<bool>()
                         ? "its component lives, but has not come back to this daemon yet"
                         : "no component has the output port open: it was never started, has "
                           "closed the port, or its process has died");
  } else if (is_stopped(output->at("component").at("pid"))) {
    result.push_back("its component " + component_text(*output) +
                     " is stopped: its process does not run");
  }
}

}  // namespace arbiter::cli
