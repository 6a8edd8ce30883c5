#include "cli/obstacles.hpp"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <string_view>
#include <utility>

#include "rules/names.hpp"

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

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// The open ports of a list that the model does not mention, and that `name` may stand for.
const json* find_near(const json& list, const std::vector<std::string>& known,
                      const std::string& name) {
  if (known.empty()) return nullptr;  // what it mentions is not known
  std::vector<std::string_view> names;
  for (const auto& each : list) {
    const auto& candidate = each.at("name").get_ref<const std::string&>();
    if (each.at("open").get<bool>() && !contains(known, candidate)) names.push_back(candidate);
  }
  const auto similar = rules::find_similar(name, names);
  return similar ? find_named(list, "name", *similar) : nullptr;
}

std::string unmentioned_text(const json& port) {
  return "component " + component_text(port) + " has " + port.at("name").get<std::string>() +
         " open, which the model does not mention; is that the one meant?";
}

}  // namespace

Obstacles::Obstacles(const json& status, const std::string& port, const Sources& sources,
                     std::vector<std::string> known_sources, std::vector<std::string> known_ports)
    : status_(status),
      port_(port),
      sources_(sources),
      known_sources_(std::move(known_sources)),
      known_ports_(std::move(known_ports)),
      input_(find_named(status.at("inputs"), "name", port)) {}

std::vector<Obstacle> Obstacles::of_port() const {
  std::vector<Obstacle> result;
  if (input_ == nullptr || !input_->at("open").get<bool>()) {
    const bool is_away = input_ != nullptr && input_->at("away").get<bool>();
    if (is_away) {
      result.push_back({"component-away",
                        "its component lives, but has not come back to this "
                        "daemon yet"});
    } else {
      result.push_back({"port-not-open", "no component has the port open: nothing is taken"});
    }
  } else if (is_stopped(input_->at("component").at("pid"))) {
    result.push_back({"component-stopped", "its component " + component_text(*input_) +
                                               " is stopped: its process does not run"});
  }
  add_port_name(result);
  return result;
}

// One of the two names is misspelt: the model's, or the component's.
void Obstacles::add_port_name(std::vector<Obstacle>& result) const {
  if (!contains(known_ports_, port_)) {
    const std::vector<std::string_view> ports(known_ports_.begin(), known_ports_.end());
    if (const auto similar = rules::find_similar(port_, ports)) {
      result.push_back(
          {"near-name", "the model mentions " + *similar + "; is that the one meant?"});
    }
  } else if (input_ == nullptr || !input_->at("open").get<bool>()) {
    const json* other = find_near(status_.at("inputs"), known_ports_, port_);
    if (other != nullptr) result.push_back({"near-name", unmentioned_text(*other)});
  }
}

const json* Obstacles::connection_of(const std::string& source) const {
  return input_ == nullptr ? nullptr : find_named(input_->at("connections"), "source", source);
}

std::vector<Obstacle> Obstacles::of_connection(const std::string& source) const {
  std::vector<Obstacle> result;
  add_publisher(source, result);
  const json* found = connection_of(source);
  if (found == nullptr) return result;
  const json& connection = *found;
  if (connection.at("state") == "mismatch") {
    result.push_back({"type-mismatch", "not connected, the two ports do not fit: " +
                                           connection.at("mismatch").get<std::string>()});
    return result;
  }
  const auto count = [&](const char* key) { return connection.value(key, std::uint64_t{0}); };
  const auto say = [&](const char* key, const char* code, const std::string& what) {
    if (count(key) != 0) result.push_back({code, std::to_string(count(key)) + what});
  };
  const std::string component =
      input_->at("open").get<bool>() ? "component " + component_text(*input_) : "the component";
  say("refused", "refused", " samples were refused, because the queue was full (refuse_new)");
  say("overtaken", "overtaken",
      " samples were lost to newer ones, because " + component + " takes too slowly");
  say("dropped", "dropped",
      " samples that had been accepted were dropped at the take, because it was not "
      "the winner any more then");
  say("waiting", "waiting", " samples wait to be taken");
  if (count("accepted") != 0 && count("taken") + count("dropped") == 0) {
    result.push_back({"none-taken", component + " has not taken any of the " +
                                        std::to_string(count("accepted")) + " accepted samples"});
  }
  return result;
}

std::vector<Obstacle> Obstacles::of_source(const std::string& source) const {
  std::vector<Obstacle> result;
  add_publisher(source, result);
  return result;
}

void Obstacles::add_publisher(const std::string& source, std::vector<Obstacle>& result) const {
  const json* output = find_named(status_.at("sources"), "name", source);
  if (output == nullptr) return;
  const bool is_latched =
      sources_.is_active(source) && sources_.state(source).timeout == shm::kForever;
  if (output->at("open").get<bool>()) {
    if (is_stopped(output->at("component").at("pid"))) {
      result.push_back({"component-stopped", "its component " + component_text(*output) +
                                                 " is stopped: its process does not run"});
    }
    return;
  }
  if (output->at("away").get<bool>()) {
    result.push_back({"component-away",
                      "its component lives, but has not come back to this "
                      "daemon yet"});
    return;
  }
  if (sources_.state(source).word == shm::kNeverActive) {
    result.push_back({"output-not-open",
                      "no component has the output port open: it was never "
                      "started, or opens it under another name"});
  } else {
    result.push_back({"output-not-open",
                      "no component has the output port open any more: it has closed the port, or "
                      "its process has died"});
  }
  if (is_latched) {
    result.push_back({"latched", "T is forever, so that it stays active; arbiter deactivate " +
                                     source + " ends it"});
  }
  if (auto other = other_source(source)) result.push_back(std::move(*other));
}

std::optional<Obstacle> Obstacles::other_source(const std::string& name) const {
  const json* other = find_near(status_.at("sources"), known_sources_, name);
  if (other == nullptr) return std::nullopt;
  return Obstacle{"near-name", unmentioned_text(*other)};
}

std::string Obstacles::why_nothing_comes_of(const std::string& source) const {
  if (input_ == nullptr || !input_->at("open").get<bool>()) return "no component has it open";
  const json* connection = connection_of(source);
  if (connection != nullptr && connection->at("state") == "mismatch") {
    return "the two ports do not fit, " + connection->at("mismatch").get<std::string>();
  }
  const json* output = find_named(status_.at("sources"), "name", source);
  if (output == nullptr || !output->at("open").get<bool>()) return "";
  if (output->at("published") == 0 && output->at("signals") != 0) {
    return component_text(*output) + " only signals, and publishes no samples";
  }
  return "";
}

bool Obstacles::was_never_started(const std::string& source) const {
  const json* output = find_named(status_.at("sources"), "name", source);
  return output != nullptr && !output->at("open").get<bool>() && !output->at("away").get<bool>() &&
         sources_.state(source).word == shm::kNeverActive && !other_source(source);
}

std::string Obstacles::component_of(const std::string& source) const {
  const json* output = find_named(status_.at("sources"), "name", source);
  return output == nullptr || !output->at("open").get<bool>() ? "" : component_text(*output);
}

json to_json(const std::vector<Obstacle>& obstacles) {
  json result = json::array();
  for (const auto& each : obstacles) result.push_back({{"code", each.code}, {"text", each.text}});
  return result;
}

}  // namespace arbiter::cli
