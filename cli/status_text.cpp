#include "cli/status_text.hpp"

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/live.hpp"
#include "rules/text/names.hpp"
#include "shm/clock.hpp"
#include "shm/utf8.hpp"
#include "watch/past.hpp"
#include "watch/process.hpp"

namespace arbiter::cli {
namespace {

// Processes of other hosts are not to be seen from here.
bool is_stopped(StatusPlace place, int pid) {
  return place == StatusPlace::kHere && watch::is_stopped(pid);
}

std::string process_text(StatusPlace place, const wire::Component& component) {
  return component.node + " (pid " + std::to_string(component.pid) +
         (is_stopped(place, component.pid) ? ", stopped)" : ")");
}

// Of a source or an input port.
std::string holder(StatusPlace place, const auto& port) {
  if (port.away_pid) {
    return "pid " + std::to_string(*port.away_pid) +
           (is_stopped(place, *port.away_pid) ? ", stopped" : "") +
           ", has not come back yet: its connections keep working";
  }
  return port.open ? process_text(place, port.open->component) : "not open";
}

// What its component says of it.
void print_outside(std::ostream& out, const auto& port, const char* how) {
  if (!port.open || !port.open->described) return;
  out << "           " << (port.open->trouble.value_or(false) ? "TROUBLE: " : "") << how
      << shm::printable(*port.open->described) << '\n';
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

void print_model(std::ostream& out, const wire::Status& status) {
  const wire::ModelStatus& model = status.model;
  out << "instance " << status.instance << ", pid " << status.pid << ", model " << model.generation;
  if (status.models.size() > 1) out << ' ' << model.name.value_or("-");
  for (const auto& file : model.files) out << ' ' << shm::printable(file);
  if (model.application) out << ", application " << shm::printable(*model.application);
  out << '\n';
  if (model.refused) {
    out << "  the files of --model were refused, so it keeps the model of the last daemon; mend "
           "them, then run arbiter reload: "
        << shm::printable(model.refused->why) << '\n';
  }
  if (model.reloads_refused != 0) {
    out << "  " << rules::counted(model.reloads_refused, "reload")
        << " refused since this daemon started; its log says why\n";
  }
}

// Of a model in force; without one there is nothing to be misspelt.
const char* unmentioned(const auto& port, bool has_model) {
  return !has_model || port.mentioned ? "" : " (the model does not mention it)";
}

// Who else runs, though nothing of it is seen below.
void print_strangers(std::ostream& out, StatusPlace place,
                     const std::vector<wire::StrangerStatus>& strangers) {
  if (strangers.empty()) return;
  out << "\nunknown to this daemon, because the state of the last daemon is lost; they "
         "continue by themselves: restart them\n";
  for (const auto& each : strangers) {
    out << "  " << process_text(place, {each.node, each.pid, each.user});
    for (const auto& port : each.outputs) out << ' ' << port;
    for (const auto& port : each.inputs) out << ' ' << port;
    if (place == StatusPlace::kHere) {  // clocks of other hosts are others
      out << "  asked " << seconds_text(shm::monotonic_now() - each.seen) << " ago";
    }
    out << '\n';
  }
}

void print_refusal(std::ostream& out, StatusPlace place, const wire::RefusalStatus& refusal) {
  out << "refused to " << process_text(place, {refusal.node, refusal.pid, refusal.user});
  if (place == StatusPlace::kHere) {
    out << ' ' << seconds_text(shm::monotonic_now() - refusal.at) << " ago";
  }
  out << ": " << shm::printable(refusal.why) << '\n';
}

// Who has asked for a port that nobody has open, in vain.
void print_refusals(std::ostream& out, StatusPlace place, const wire::Status& status,
                    std::optional<std::string> wire::RefusalStatus::*end, const auto& port) {
  if (port.open || port.away_pid) return;
  for (const wire::RefusalStatus& each : status.refusals) {
    if (each.*end != port.name) continue;
    out << "           ";
    print_refusal(out, place, each);
  }
}

// Of ports that are nowhere above: nobody has them open, and the model does not mention them.
void print_other_refusals(std::ostream& out, StatusPlace place, const wire::Status& status) {
  bool is_first = true;
  for (const wire::RefusalStatus& each : status.refusals) {
    const bool is_above = (each.output && status.find_source(*each.output) != nullptr) ||
                          (each.input && status.find_input(*each.input) != nullptr);
    if (is_above || (!each.output && !each.input)) continue;
    if (std::exchange(is_first, false)) {
      out << "\nrefused, of ports that the model does not mention\n";
    }
    out << "  " << (each.output ? *each.output : *each.input) << "  ";
    print_refusal(out, place, each);
  }
}

// Who had the port open last, and died.
void print_death(std::ostream& out, StatusPlace place, const wire::Status& status,
                 const watch::PortEnd& end, const auto& port) {
  const wire::DeathStatus* const death = watch::death_of(status, end, port.name);
  if (port.open || port.away_pid || death == nullptr) return;
  const auto here =
      place == StatusPlace::kHere ? std::optional(shm::monotonic_now()) : std::nullopt;
  out << "           " << watch::death_text(*death, here ? here : status.now) << '\n';
}

void print_source(std::ostream& out, StatusPlace place, const wire::SourceStatus& source,
                  bool has_model) {
  out << "  " << (source.active ? "active   " : "inactive ") << source.name << "  ["
      << holder(place, source) << type_of(source) << ']';
  if (const auto& open = source.open) {
    out << counts({{"published", open->published}}, true)
        << counts({{"signals", open->signals},
                   {"late", open->late},
                   {"blind", open->blind},
                   {"unsettled", open->unsettled},
                   {"no_slot", open->no_slot}},
                  false);
  }
  const std::string mark = unmentioned(source, has_model);
  out << (mark.empty() ? "" : " " + mark) << '\n';
  if (!source.open) return;
  print_outside(out, source, "comes from ");
  for (const auto& tap : source.open->taps) {
    out << "           tapped by " << process_text(place, tap) << ", user " << tap.user << '\n';
  }
}

// `is_useless`: it is selected, and cannot deliver.
void print_connection(std::ostream& out, const wire::ConnectionStatus& connection,
                      bool is_useless) {
  const char* mark = connection.winner   ? "  * "
                     : is_useless        ? "  x "
                     : connection.active ? "  - "
                                         : "    ";
  out << mark << connection.source;
  if (connection.mismatch) {
    out << "  NOT CONNECTED: " << *connection.mismatch << '\n';
    return;
  }
  if (!connection.is_connected()) {
    out << "  (" << connection.state() << ")\n";
    return;
  }
  out << counts({{"accepted", connection.accepted},
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

void print_input(std::ostream& out, StatusPlace place, const wire::Status& status,
                 const wire::InputStatus& input) {
  out << input.name << "  [" << holder(place, input) << type_of(input) << "]  ";
  const auto& useless = input.cannot_deliver;
  if (!input.arbitrated) {
    out << "not arbitrated" << unmentioned(input, status.model.generation != 0);
  } else if (useless) {
    out << "idle: " << useless->source << " is selected, but cannot deliver: " << useless->why;
  } else {
    out << (input.winner ? "winner " + *input.winner : "idle");
  }
  if (input.in_order) out << "  (rules tried in order)";
  if (const auto& open = input.open) {
    out << counts(
        {{"blind", open->blind}, {"unsettled", open->unsettled}, {"misbehaved", open->misbehaved}},
        false);
  }
  out << '\n';
  print_outside(out, input, "goes to ");
  print_death(out, place, status, watch::kInputEnd, input);
  print_refusals(out, place, status, &wire::RefusalStatus::input, input);
  for (const auto& connection : input.connections) {
    print_connection(out, connection, useless && useless->source == connection.source);
  }
  for (const auto& sensed : input.senses) {
    out << (sensed.active ? "  ! " : "    ") << sensed.source << "  (sensed)\n";
  }
}

}  // namespace

void write_status(std::ostream& out, const wire::Status& status, StatusPlace place) {
  print_model(out, status);
  print_strangers(out, place, status.strangers);
  const bool has_model = status.model.generation != 0;
  out << "\nsources\n";
  for (const auto& source : status.sources) {
    print_source(out, place, source, has_model);
    print_death(out, place, status, watch::kOutputEnd, source);
    print_refusals(out, place, status, &wire::RefusalStatus::output, source);
  }
  out << "\ninput ports  (* winner, x selected but cannot deliver, - active and overridden, "
         "! active and "
         "sensed)\n";
  for (const auto& input : status.inputs) print_input(out, place, status, input);
  print_other_refusals(out, place, status);
}

}  // namespace arbiter::cli
