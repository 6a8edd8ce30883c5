#include "cli/obstacles.hpp"

#include <algorithm>
#include <cstdint>
#include <set>
#include <string_view>
#include <utility>

#include "cli/live.hpp"
#include "rules/text/names.hpp"

namespace arbiter::cli {
namespace {

using nlohmann::json;

// Of whatever the status tells the node and the pid.
std::string process_text(const json& component) {
  return component.at("node").get<std::string>() + " (pid " +
         std::to_string(component.at("pid").get<int>()) + ")";
}

std::string component_text(const json& port) { return process_text(port.at("component")); }

void add_stopped(int pid, const std::string& who, std::vector<Obstacle>& result) {
  if (!is_stopped(pid)) return;
  result.push_back({"component-stopped", who + " is stopped: its process does not run"});
}

void add_away(const json& port, std::vector<Obstacle>& result) {
  const int pid = port.at("away_pid").get<int>();
  const std::string who = "its component (pid " + std::to_string(pid) + ")";
  result.push_back({"component-away", who +
                                          " lives, but has not come back to this daemon yet: what "
                                          "is connected goes on, what is new waits for it"});
  add_stopped(pid, who, result);
}

void add_unknown(const json& stranger, std::vector<Obstacle>& result) {
  const std::string who = "component " + process_text(stranger);
  result.push_back({"component-unknown",
                    who + " lives and has it open, but this daemon does not know it, for what the "
                          "last one knew is lost: it goes on by itself, as was decided last; "
                          "restart it"});
  add_stopped(stranger.at("pid").get<int>(), who, result);
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
  const json* stranger = stranger_with("inputs", port_);
  if (input_ != nullptr && input_->at("open").get<bool>()) {
    add_stopped(input_->at("component").at("pid").get<int>(),
                "its component " + component_text(*input_), result);
  } else if (is_away()) {
    add_away(*input_, result);
  } else if (stranger == nullptr) {
    result.push_back({"port-not-open", "no component has the port open: nothing is taken"});
  }
  if (stranger != nullptr) add_unknown(*stranger, result);
  add_other_strangers(result);
  add_port_name(result);
  return result;
}

bool Obstacles::is_away() const { return input_ != nullptr && input_->at("away").get<bool>(); }

const json* Obstacles::stranger_with(const char* ports, const std::string& name) const {
  for (const auto& each : status_.at("strangers")) {
    const json& list = each.at(ports);
    if (std::find(list.begin(), list.end(), name) != list.end()) return &each;
  }
  return nullptr;
}

// Those that no port and no source which is told of here names: who is said not to be there may be
// one of them.
void Obstacles::add_other_strangers(std::vector<Obstacle>& result) const {
  std::set<const json*> told{stranger_with("inputs", port_)};
  for (const char* list : {"connections", "senses"}) {
    if (input_ == nullptr) break;
    for (const auto& each : input_->at(list)) {
      told.insert(stranger_with("outputs", each.at("source").get<std::string>()));
    }
  }
  const auto others = std::count_if(status_.at("strangers").begin(), status_.at("strangers").end(),
                                    [&](const json& each) { return told.count(&each) == 0; });
  if (others == 0) return;
  result.push_back({"others-unknown", (others == 1 ? "a component runs"
                                                   : std::to_string(others) + " components run") +
                                          std::string(" that this daemon does not know: arbiter "
                                                      "status tells which")});
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
  // Counted from the opening of the ports on: it may be long ago.
  say("refused", "refused",
      " samples were refused since the ports were opened, because the queue was full then "
      "(refuse_new)");
  say("overtaken", "overtaken",
      " samples were lost to newer ones since the ports were opened, because " + component +
          " took too slowly then");
  say("dropped", "dropped",
      " samples that had been accepted were dropped at the take since the ports were opened, "
      "because it was not the winner any more then");
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
  const json* stranger = stranger_with("outputs", source);
  if (stranger != nullptr) add_unknown(*stranger, result);
  if (output == nullptr) return;
  const bool is_latched =
      sources_.is_active(source) && sources_.state(source).timeout == shm::kForever;
  if (output->at("open").get<bool>()) {
    add_stopped(output->at("component").at("pid").get<int>(),
                "its component " + component_text(*output), result);
    return;
  }
  if (output->at("away").get<bool>()) {
    add_away(*output, result);
    return;
  }
  if (stranger != nullptr) return;
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

std::string Obstacles::why_it_cannot_deliver(const std::string& source) const {
  if (input_ == nullptr || input_->at("cannot_deliver").is_null()) return {};
  const json& selected = input_->at("cannot_deliver");
  return selected.at("source") == source ? selected.at("why").get<std::string>() : std::string();
}

std::string Obstacles::why_nothing_comes_of(const std::string& source) const {
  if (!is_away() && (input_ == nullptr || !input_->at("open").get<bool>())) {
    const json* stranger = stranger_with("inputs", port_);
    if (stranger == nullptr) return "no component has it open";
    return process_text(*stranger) + " has it open, which this daemon does not know";
  }
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
         stranger_with("outputs", source) == nullptr &&
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
