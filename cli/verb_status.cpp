// arbiter status: ports, connections, who is active, who wins, and the counters.
#include <cstdint>
#include <iomanip>
#include <iostream>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/live.hpp"
#include "cli/verbs.hpp"
#include "shm/clock.hpp"

namespace arbiter::cli {
namespace {

using nlohmann::json;

struct StatusOptions {
  std::string instance;
  bool json = false;
};

std::string holder(const json& port) {
  if (port.at("away").get<bool>()) {
    const int pid = port.at("away_pid").get<int>();
    return "pid " + std::to_string(pid) + (is_stopped(pid) ? ", stopped" : "") +
           ", has not come back yet: what is connected goes on";
  }
  if (!port.at("open").get<bool>()) return "not open";
  const json& component = port.at("component");
  const int pid = component.at("pid").get<int>();
  return component.at("node").get<std::string>() + " (pid " + std::to_string(pid) +
         (is_stopped(pid) ? ", stopped)" : ")");
}

std::string type_of(const json& port) {
  const auto type = port.find("type");
  if (type == port.end()) return "";
  return type->is_null() ? ", untyped" : ", " + type->at("name").get<std::string>();
}

// "  key 3" for each of the counters that is worth saying.
std::string counts(const json& of, std::initializer_list<const char*> keys, bool zeros) {
  std::string text;
  for (const char* key : keys) {
    const auto value = of.value(key, std::uint64_t{0});
    if (value != 0 || zeros) text += std::string("  ") + key + ' ' + std::to_string(value);
  }
  return text;
}

void print_model(const json& status) {
  const json& model = status.at("model");
  std::cout << "instance " << status.at("instance").get<std::string>() << ", pid "
            << status.at("pid") << ", model " << model.at("generation");
  if (status.at("models").size() > 1) std::cout << ' ' << model.at("name").get<std::string>();
  for (const auto& file : model.at("files")) std::cout << ' ' << file.get<std::string>();
  if (!model.at("application").is_null()) {
    std::cout << ", application " << model.at("application").get<std::string>();
  }
  std::cout << '\n';
  if (model.at("reloads_refused") != 0) {
    std::cout << "  " << model.at("reloads_refused")
              << " reloads refused: the daemon's log says why\n";
  }
}

// Of a model in force; without one there is nothing to be misspelt.
const char* unmentioned(const json& port, bool has_model) {
  if (!has_model || port.at("mentioned").get<bool>()) return "";
  return " (the model does not mention it)";
}

// Who else runs, though nothing of it is seen below.
void print_strangers(const json& strangers) {
  if (strangers.empty()) return;
  std::cout << "\nunknown to this daemon, for what the last one knew is lost; they go on by "
               "themselves: restart them\n";
  for (const auto& each : strangers) {
    const int pid = each.at("pid").get<int>();
    std::cout << "  " << each.at("node").get<std::string>() << " (pid " << pid
              << (is_stopped(pid) ? ", stopped)" : ")");
    for (const char* ports : {"outputs", "inputs"}) {
      for (const auto& port : each.at(ports)) std::cout << ' ' << port.get<std::string>();
    }
    std::cout << "  asked "
              << seconds_text(shm::monotonic_now() - each.at("seen_ns").get<shm::Nanoseconds>())
              << " ago\n";
  }
}

void print_source(const json& source, bool has_model) {
  std::cout << "  " << (source.at("active").get<bool>() ? "active   " : "inactive ")
            << source.at("name").get<std::string>() << "  [" << holder(source) << type_of(source)
            << ']';
  if (source.at("open").get<bool>()) {
    std::cout << counts(source, {"published"}, true)
              << counts(source, {"signals", "late", "blind", "unsettled", "no_slot"}, false);
  }
  const std::string mark = unmentioned(source, has_model);
  std::cout << (mark.empty() ? "" : " " + mark) << '\n';
}

// `is_useless`: it is selected, and cannot deliver.
void print_connection(const json& connection, bool is_useless) {
  const bool wins = connection.at("winner").get<bool>();
  const char* mark = wins                                  ? "  * "
                     : is_useless                          ? "  x "
                     : connection.at("active").get<bool>() ? "  - "
                                                           : "    ";
  std::cout << mark << connection.at("source").get<std::string>();
  if (connection.at("state") == "mismatch") {
    std::cout << "  MISMATCH: " << connection.at("mismatch").get<std::string>() << '\n';
    return;
  }
  if (connection.at("state") != "connected") {
    std::cout << "  (" << connection.at("state").get<std::string>() << ")\n";
    return;
  }
  std::cout << counts(connection, {"accepted", "discarded", "taken"}, true)
            << counts(connection, {"dropped", "overtaken", "refused", "waiting"}, false) << '\n';
}

void print_input(const json& input, bool has_model) {
  std::cout << input.at("name").get<std::string>() << "  [" << holder(input) << type_of(input)
            << "]  ";
  if (!input.at("arbitrated").get<bool>()) {
    std::cout << "not arbitrated" << unmentioned(input, has_model);
  } else if (!input.at("cannot_deliver").is_null()) {
    const json& selected = input.at("cannot_deliver");
    std::cout << "idle: " << selected.at("source").get<std::string>()
              << " is selected, but cannot deliver: " << selected.at("why").get<std::string>();
  } else if (input.at("winner").is_null()) {
    std::cout << "idle";
  } else {
    std::cout << "winner " << input.at("winner").get<std::string>();
  }
  if (input.at("in_order").get<bool>()) std::cout << "  (rules tried in order)";
  std::cout << counts(input, {"blind", "unsettled", "misbehaved"}, false) << '\n';
  const json& useless = input.at("cannot_deliver");
  for (const auto& connection : input.at("connections")) {
    print_connection(connection,
                     !useless.is_null() && useless.at("source") == connection.at("source"));
  }
  for (const auto& sensed : input.at("senses")) {
    std::cout << (sensed.at("active").get<bool>() ? "  ! " : "    ")
              << sensed.at("source").get<std::string>() << "  (sensed)\n";
  }
}

int status(const StatusOptions& options) {
  const auto node = connect("status", options.instance);
  const json document = fetch_status(*node);
  if (options.json) {
    std::cout << document.dump(2) << '\n';
    return 0;
  }
  print_model(document);
  print_strangers(document.at("strangers"));
  const bool has_model = document.at("model").at("generation") != 0;
  std::cout << "\nsources\n";
  for (const auto& source : document.at("sources")) print_source(source, has_model);
  std::cout << "\ninput ports  (* winner, x selected but cannot deliver, - active and overridden, "
               "! active and "
               "sensed)\n";
  for (const auto& input : document.at("inputs")) print_input(input, has_model);
  return 0;
}

}  // namespace

void add_status(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<StatusOptions>();
  CLI::App* verb = app.add_subcommand("status", "Show ports, connections, winners and counters");
  verb->add_flag("--json", options->json, "As the daemon's JSON document");
  add_instance_option(*verb, options->instance);
  verb->footer("Example:\n  arbiter status");
  verb->callback([options, &exit_code] { exit_code = status(*options); });
}

}  // namespace arbiter::cli
