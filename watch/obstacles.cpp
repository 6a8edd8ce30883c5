#include "watch/obstacles.hpp"

#include <algorithm>
#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "rules/text/names.hpp"
#include "shm/clock.hpp"
#include "shm/type_info.hpp"
#include "shm/utf8.hpp"
#include "watch/past.hpp"
#include "watch/process.hpp"
#include "watch/span.hpp"

namespace arbiter::watch {
namespace {

using wire::StrangerStatus;

// Of a port that is open.
std::string component_text(const auto& port) { return process_text(port.open->component); }

void add_stopped(int pid, const std::string& who, std::vector<Obstacle>& result) {
  if (!is_stopped(pid)) return;
  result.push_back({"component-stopped", who + " is stopped: its process does not run"});
}

void add_away(int pid, std::vector<Obstacle>& result) {
  const std::string who = "its component (pid " + std::to_string(pid) + ")";
  result.push_back({"component-away", who + " lives, but has not come back to this daemon yet: its "
                                            "connections keep working, new ones wait for it"});
  add_stopped(pid, who, result);
}

void add_unknown(const StrangerStatus& stranger, std::vector<Obstacle>& result) {
  const std::string who = "component " + process_text(stranger);
  result.push_back(
      {"component-unknown",
       who + " lives and has it open, but this daemon does not know it, because the state of the "
             "last daemon is lost: it continues under the last decisions it knew; restart it"});
  add_stopped(stranger.pid, who, result);
}

// What the component says of its port, in words of its own: how things stand outside may be what
// keeps samples out.
void add_outside(const std::string& name, const char* how, const auto& open,
                 std::vector<Obstacle>& result) {
  if (!open.described) return;
  std::string text = name + how + shm::printable(*open.described);
  if (is_stopped(open.component.pid)) text += " (as it said before it was stopped)";
  result.push_back({"outside", std::move(text), open.trouble.value_or(false)});
}

shm::TypeInfo type_info(const std::optional<wire::SampleType>& type) {
  shm::TypeInfo info;
  if (!type) return info;
  info.set_name(type->name);
  info.size = type->size;
  info.alignment = type->alignment;
  return info;
}

// Why the queue has fewer places than the input port has asked for; empty: it has as many.
std::string shorter_queue(const wire::ConnectionStatus& connection,
                          const wire::InputStatus& input) {
  if (!input.open || !connection.depth || *connection.depth >= input.open->depth) return {};
  return "the queue has " + rules::counted(*connection.depth, "place") + " in place of " +
         std::to_string(input.open->depth) + ", because max_memory of " + connection.source +
         " leaves no more";
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// "; gaze-control (pid 4711) had it open, and died 3 s ago", or nothing.
std::string and_death_text(const wire::DeathStatus* death) {
  return death == nullptr ? "" : "; " + death_text(*death, shm::monotonic_now());
}

void add_refused_model(const wire::ModelStatus& model, std::vector<Obstacle>& result) {
  if (!model.refused) return;
  result.push_back(
      {"model-refused",
       "the files of --model were refused, so the daemon keeps the model of the last one: it knows "
       "the decisions, but not the behaviours behind them; mend the files, then run arbiter "
       "reload; the first error: " +
           shm::printable(model.refused->why)});
}

void add_refusal(const wire::RefusalStatus* refusal, std::vector<Obstacle>& result) {
  if (refusal == nullptr) return;
  result.push_back(
      {"opening-refused", "component " + process_text(*refusal) + " asked for the port " +
                              span_text(shm::monotonic_now() - refusal->at) +
                              " ago and was refused: " + shm::printable(refusal->why)});
}

// The open port of a list that the model does not mention, and that `name` may stand for.
template <class Port>
const Port* find_near(const std::vector<Port>& list, const std::vector<std::string>& known,
                      const std::string& name) {
  if (known.empty()) return nullptr;  // what it mentions is not known
  std::vector<std::string_view> names;
  for (const Port& each : list) {
    if (each.open && !contains(known, each.name)) names.push_back(each.name);
  }
  const auto similar = rules::find_similar(name, names);
  if (!similar) return nullptr;
  return &*std::find_if(list.begin(), list.end(),
                        [&](const Port& each) { return each.name == *similar; });
}

std::string unmentioned_text(const auto& port) {
  return "component " + component_text(port) + " has " + port.name +
         " open, which the model does not mention; did you mean that one?";
}

}  // namespace

Obstacles::Obstacles(const wire::Status& status, const std::string& port, const Sources& sources,
                     std::vector<std::string> known_sources, std::vector<std::string> known_ports,
                     Fates fates)
    : status_(status),
      port_(port),
      sources_(sources),
      known_sources_(std::move(known_sources)),
      known_ports_(std::move(known_ports)),
      fates_(std::move(fates)),
      input_(status.find_input(port)) {}

std::vector<Obstacle> Obstacles::of_port() const {
  std::vector<Obstacle> result;
  const StrangerStatus* stranger = stranger_with(&StrangerStatus::inputs, port_);
  if (is_open()) {
    add_stopped(input_->open->component.pid, "its component " + component_text(*input_), result);
    add_outside(port_, " goes to ", *input_->open, result);
  } else if (is_away()) {
    add_away(*input_->away_pid, result);
  } else if (stranger == nullptr) {
    result.push_back({"port-not-open", "no component has the port open: nothing is taken" +
                                           and_death_text(death_of(status_, kInputEnd, port_))});
    add_refusal(refusal_of(status_, kInputEnd, port_), result);
  }
  if (stranger != nullptr) add_unknown(*stranger, result);
  add_refused_model(status_.model, result);
  add_other_strangers(result);
  add_port_name(result);
  return result;
}

const StrangerStatus* Obstacles::stranger_with(Ports ports, const std::string& name) const {
  const auto found =
      std::find_if(status_.strangers.begin(), status_.strangers.end(),
                   [&](const StrangerStatus& each) { return contains(each.*ports, name); });
  return found == status_.strangers.end() ? nullptr : &*found;
}

// Those that no port and no source that is spoken of here names: one of them may be what seems to
// be missing.
void Obstacles::add_other_strangers(std::vector<Obstacle>& result) const {
  std::set<const StrangerStatus*> told{stranger_with(&StrangerStatus::inputs, port_)};
  const auto tell = [&](const std::string& source) {
    told.insert(stranger_with(&StrangerStatus::outputs, source));
  };
  if (input_ != nullptr) {
    for (const auto& each : input_->connections) tell(each.source);
    for (const auto& each : input_->senses) tell(each.source);
  }
  const auto others =
      std::count_if(status_.strangers.begin(), status_.strangers.end(),
                    [&](const StrangerStatus& each) { return told.count(&each) == 0; });
  if (others == 0) return;
  result.push_back(
      {"others-unknown",
       (others == 1 ? "a component runs" : std::to_string(others) + " components run") +
           std::string(" that this daemon does not know: arbiter status lists them")});
}

// One of the two names is misspelt: the model's, or the component's.
void Obstacles::add_port_name(std::vector<Obstacle>& result) const {
  if (!contains(known_ports_, port_)) {
    const std::vector<std::string_view> ports(known_ports_.begin(), known_ports_.end());
    if (const auto similar = rules::find_similar(port_, ports)) {
      result.push_back(
          {"near-name", "the model mentions " + *similar + "; did you mean that one?"});
    }
  } else if (!is_open()) {
    const auto* other = find_near(status_.inputs, known_ports_, port_);
    if (other != nullptr) result.push_back({"near-name", unmentioned_text(*other)});
  }
}

const wire::ConnectionStatus* Obstacles::connection_of(const std::string& source) const {
  if (input_ == nullptr) return nullptr;
  const auto found = std::find_if(input_->connections.begin(), input_->connections.end(),
                                  [&](const auto& each) { return each.source == source; });
  return found == input_->connections.end() ? nullptr : &*found;
}

std::vector<Obstacle> Obstacles::of_connection(const std::string& source) const {
  std::vector<Obstacle> result;
  add_publisher(source, result);
  const wire::ConnectionStatus* found = connection_of(source);
  if (found == nullptr) return result;
  const wire::ConnectionStatus& connection = *found;
  const wire::SourceStatus* output = status_.find_source(source);
  if (connection.mismatch) {
    const bool fits =
        is_open() && output != nullptr && output->open &&
        shm::type_mismatch(type_info(output->open->type), type_info(input_->open->type)).empty();
    const std::string what = fits ? "not connected: " : "not connected, the two ports do not fit: ";
    result.push_back({"type-mismatch", what + *connection.mismatch});
    return result;
  }
  const auto say = [&](std::uint64_t count, const char* code, const char* of_one,
                       const char* of_several, const std::string& what, bool is_wrong) {
    if (count == 0) return;
    result.push_back({code,
                      rules::counted(count, "sample") + (count == 1 ? of_one : of_several) + what,
                      is_wrong});
  };
  const std::string component =
      is_open() ? "component " + component_text(*input_) : "the component";
  const std::string shorter = shorter_queue(connection, *input_);
  // Counted from the opening of the ports on: it may be long ago.
  say(connection.refused, "refused", " has", " have",
      " been refused since the ports were opened, because the queue was full (refuse_new)" +
          (shorter.empty() ? "" : ": " + shorter),
      true);
  // With room for one sample, a component wants the newest, and no other.
  const bool wants_newest = shorter.empty() && is_open() && input_->open->depth == 1;
  say(connection.overtaken, "overtaken", " has", " have",
      " been lost to newer ones since the ports were opened, because " +
          (wants_newest      ? "the queue keeps the newest alone (depth 1)"
           : shorter.empty() ? component + " took them too slowly"
                             : shorter),
      !wants_newest);
  // Arbitration at both ends is no fault, nor is a component that takes when it wants to.
  say(connection.dropped, "dropped", " that had been accepted was", " that had been accepted were",
      " dropped at the take since the ports were opened, because this connection no longer won",
      false);
  say(connection.waiting, "waiting", " waits", " wait", " to be taken", false);
  if (connection.accepted != 0 && connection.taken + connection.dropped == 0) {
    result.push_back({"none-taken", component + " has not taken " +
                                        (connection.accepted == 1
                                             ? "the accepted sample"
                                             : "any of the " + std::to_string(connection.accepted) +
                                                   " accepted samples")});
  }
  return result;
}

std::vector<Obstacle> Obstacles::of_source(const std::string& source) const {
  std::vector<Obstacle> result;
  add_publisher(source, result);
  return result;
}

void Obstacles::add_publisher(const std::string& source, std::vector<Obstacle>& result) const {
  const wire::SourceStatus* output = status_.find_source(source);
  const StrangerStatus* stranger = stranger_with(&StrangerStatus::outputs, source);
  if (stranger != nullptr) add_unknown(*stranger, result);
  if (output == nullptr) return;
  const SourceState state = sources_.state(source);
  const bool is_latched = sources_.is_active(source) && state.timeout == shm::kForever;
  if (output->open) {
    add_stopped(output->open->component.pid, "its component " + component_text(*output), result);
    if (state.gap) {
      result.push_back({"slow-publisher", "its last two arrivals were " + span_text(*state.gap) +
                                              " apart, and its T is " + span_text(state.timeout) +
                                              ": it is inactive in between"});
    }
    add_outside(source, " comes from ", *output->open, result);
    return;
  }
  if (output->away_pid) {
    add_away(*output->away_pid, result);
    return;
  }
  if (stranger != nullptr) return;
  const auto* refusal = refusal_of(status_, kOutputEnd, source);
  const auto* death = death_of(status_, kOutputEnd, source);
  const auto fate = fates_.find(source);
  const std::string not_open = "no component has the output port open";
  if (refusal != nullptr) {
    result.push_back({"output-not-open", not_open});
    add_refusal(refusal, result);
  } else if (death != nullptr) {
    result.push_back({"output-not-open", not_open + " any longer" + and_death_text(death)});
  } else if (fate != fates_.end()) {
    result.push_back({"output-not-open", not_open + " any longer; " + fate->second});
  } else if (state.word == shm::kNeverActive) {
    result.push_back({"output-not-open",
                      not_open + ", and it was never active: its component does not run, or opens "
                                 "it under another name"});
  } else {
    result.push_back({"output-not-open", not_open +
                                             " any longer: its component closed it or died, or the "
                                             "host that it came from is gone"});
  }
  if (is_latched) {
    result.push_back(
        {"latched", "T is forever, so it stays active; arbiter deactivate " + source + " ends it"});
  }
  if (auto other = other_source(source)) result.push_back(std::move(*other));
}

std::optional<Obstacle> Obstacles::other_source(const std::string& name) const {
  const auto* other = find_near(status_.sources, known_sources_, name);
  if (other == nullptr) return std::nullopt;
  return Obstacle{"near-name", unmentioned_text(*other)};
}

std::string Obstacles::why_it_cannot_deliver(const std::string& source) const {
  if (input_ == nullptr || !input_->cannot_deliver) return {};
  return input_->cannot_deliver->source == source ? input_->cannot_deliver->why : std::string();
}

std::string Obstacles::why_nothing_comes_of(const std::string& source) const {
  if (!is_away() && !is_open()) {
    const StrangerStatus* stranger = stranger_with(&StrangerStatus::inputs, port_);
    if (stranger == nullptr) return "no component has it open";
    return process_text(*stranger) + " has it open, but this daemon does not know that component";
  }
  const wire::ConnectionStatus* connection = connection_of(source);
  if (connection != nullptr && connection->mismatch) return *connection->mismatch;
  const wire::SourceStatus* output = status_.find_source(source);
  if (output == nullptr || !output->open) return "";
  if (output->open->published == 0 && output->open->signals != 0) {
    return component_text(*output) + " only signals, and publishes no samples";
  }
  return "";
}

bool Obstacles::is_out_of_use(const std::string& source) const {
  const wire::SourceStatus* output = status_.find_source(source);
  return output != nullptr && !output->open && !output->away_pid &&
         stranger_with(&StrangerStatus::outputs, source) == nullptr &&
         refusal_of(status_, kOutputEnd, source) == nullptr &&
         death_of(status_, kOutputEnd, source) == nullptr &&
         sources_.state(source).word == shm::kNeverActive && !other_source(source);
}

std::string Obstacles::component_of(const std::string& source) const {
  const wire::SourceStatus* output = status_.find_source(source);
  return output == nullptr || !output->open ? "" : component_text(*output);
}

}  // namespace arbiter::watch
