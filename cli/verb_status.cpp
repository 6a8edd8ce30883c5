// arbiter status: ports, connections, who is active, who wins, and the counters.
#include <cstdint>
#include <initializer_list>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/live.hpp"
#include "cli/verbs.hpp"
#include "shm/clock.hpp"
#include "shm/utf8.hpp"
#include "watch/process.hpp"
#include "wire/document.hpp"
#include "wire/status.hpp"

namespace arbiter::cli {
namespace {

struct StatusOptions {
  std::string instance;
  bool json = false;
};

std::string process_text(const wire::Component& component) {
  return component.node + " (pid " + std::to_string(component.pid) +
         (watch::is_stopped(component.pid) ? ", stopped)" : ")");
}

// Of a source or an input port.
std::string holder(const auto& port) {
  if (port.away_pid) {
    return "pid " + std::to_string(*port.away_pid) +
           (watch::is_stopped(*port.away_pid) ? ", stopped" : "") +
           ", has not come back yet: its connections keep working";
  }
  return port.open ? process_text(port.open->component) : "not open";
}

// What its component says of it.
void print_outside(const auto& port, const char* how) {
  if (!port.open || !port.open->described) return;
  std::cout << "           " << how << shm::printable(*port.open->described) << '\n';
}

std::string type_of(const auto& port) {
  if (!port.open) return "";
  return port.open->type ? ", " + port.open->type->name : ", untyped";
}

struct Count {
  const char* name;
  std::uint64_t value;
};

// "  name 3" for each of the counters that is worth saying.
std::string counts(std::initializer_list<Count> counters, bool zeros) {
  std::string text;
  for (const auto& [name, value] : counters) {
    if (value != 0 || zeros) text += std::string("  ") + name + ' ' + std::to_string(value);
  }
  return text;
}

void print_model(const wire::Status& status) {
  const wire::ModelStatus& model = status.model;
  std::cout << "instance " << status.instance << ", pid " << status.pid << ", model "
            << model.generation;
  if (status.models.size() > 1) std::cout << ' ' << model.name.value_or("-");
  for (const auto& file : model.files) std::cout << ' ' << file;
  if (model.application) std::cout << ", application " << *model.application;
  std::cout << '\n';
  if (model.reloads_refused != 0) {
    std::cout << "  " << model.reloads_refused << " reloads refused: the daemon's log says why\n";
  }
}

// Of a model in force; without one there is nothing to be misspelt.
const char* unmentioned(const auto& port, bool has_model) {
  return !has_model || port.mentioned ? "" : " (the model does not mention it)";
}

// Who else runs, though nothing of it is seen below.
void print_strangers(const std::vector<wire::StrangerStatus>& strangers) {
  if (strangers.empty()) return;
  std::cout << "\nunknown to this daemon, because the state of the last daemon is lost; they "
               "continue by themselves: restart them\n";
  for (const auto& each : strangers) {
    std::cout << "  " << process_text({each.node, each.pid, each.user});
    for (const auto& port : each.outputs) std::cout << ' ' << port;
    for (const auto& port : each.inputs) std::cout << ' ' << port;
    std::cout << "  asked " << seconds_text(shm::monotonic_now() - each.seen) << " ago\n";
  }
}

void print_source(const wire::SourceStatus& source, bool has_model) {
  std::cout << "  " << (source.active ? "active   " : "inactive ") << source.name << "  ["
            << holder(source) << type_of(source) << ']';
  if (const auto& open = source.open) {
    std::cout << counts({{"published", open->published}}, true)
              << counts({{"signals", open->signals},
                         {"late", open->late},
                         {"blind", open->blind},
                         {"unsettled", open->unsettled},
                         {"no_slot", open->no_slot}},
                        false);
  }
  const std::string mark = unmentioned(source, has_model);
  std::cout << (mark.empty() ? "" : " " + mark) << '\n';
  if (!source.open) return;
  print_outside(source, "comes from ");
  for (const auto& tap : source.open->taps) {
    std::cout << "           tapped by " << process_text(tap) << ", user " << tap.user << '\n';
  }
}

// `is_useless`: it is selected, and cannot deliver.
void print_connection(const wire::ConnectionStatus& connection, bool is_useless) {
  const char* mark = connection.winner   ? "  * "
                     : is_useless        ? "  x "
                     : connection.active ? "  - "
                                         : "    ";
  std::cout << mark << connection.source;
  if (connection.mismatch) {
    std::cout << "  MISMATCH: " << *connection.mismatch << '\n';
    return;
  }
  if (!connection.is_connected()) {
    std::cout << "  (" << connection.state() << ")\n";
    return;
  }
  std::cout << counts({{"accepted", connection.accepted},
                       {"discarded", connection.discarded},
                       {"taken", connection.taken}},
                      true)
            << counts({{"dropped", connection.dropped},
                       {"overtaken", connection.overtaken},
                       {"refused", connection.refused},
                       {"waiting", connection.waiting}},
                      false)
            << '\n';
}

void print_input(const wire::InputStatus& input, bool has_model) {
  std::cout << input.name << "  [" << holder(input) << type_of(input) << "]  ";
  const auto& useless = input.cannot_deliver;
  if (!input.arbitrated) {
    std::cout << "not arbitrated" << unmentioned(input, has_model);
  } else if (useless) {
    std::cout << "idle: " << useless->source
              << " is selected, but cannot deliver: " << useless->why;
  } else {
    std::cout << (input.winner ? "winner " + *input.winner : "idle");
  }
  if (input.in_order) std::cout << "  (rules tried in order)";
  if (const auto& open = input.open) {
    std::cout << counts(
        {{"blind", open->blind}, {"unsettled", open->unsettled}, {"misbehaved", open->misbehaved}},
        false);
  }
  std::cout << '\n';
  print_outside(input, "goes to ");
  for (const auto& connection : input.connections) {
    print_connection(connection, useless && useless->source == connection.source);
  }
  for (const auto& sensed : input.senses) {
    std::cout << (sensed.active ? "  ! " : "    ") << sensed.source << "  (sensed)\n";
  }
}

int status(const StatusOptions& options) {
  const std::string text = fetch_status_text("status", options.instance);
  if (options.json) {
    // As the daemon has it: a newer one may say more than this program knows.
    std::cout << wire::write_document(wire::parse_document(text));
    return 0;
  }
  const wire::Status status = wire::read_status(text);
  print_model(status);
  print_strangers(status.strangers);
  const bool has_model = status.model.generation != 0;
  std::cout << "\nsources\n";
  for (const auto& source : status.sources) print_source(source, has_model);
  std::cout << "\ninput ports  (* winner, x selected but cannot deliver, - active and overridden, "
               "! active and "
               "sensed)\n";
  for (const auto& input : status.inputs) print_input(input, has_model);
  return 0;
}

}  // namespace

void add_status(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<StatusOptions>();
  CLI::App* verb = app.add_subcommand("status", "Show ports, connections, winners and counters");
  verb->add_flag("--json", options->json, "Write the daemon's JSON document");
  add_instance_option(*verb, options->instance);
  verb->footer("Example:\n  arbiter status");
  verb->callback([options, &exit_code] { exit_code = status(*options); });
}

}  // namespace arbiter::cli
