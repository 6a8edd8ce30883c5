// What components should know of their ports, and the log too: connections that are refused, ports
// that the model does not mention, ports that cannot see.
#include <algorithm>
#include <string_view>
#include <utility>
#include <vector>

#include "rules/text/names.hpp"
#include "service/kept/step.hpp"
#include "service/log/event.hpp"
#include "service/log/log.hpp"
#include "service/ports/switchboard.hpp"

namespace arbiter::service {
namespace {

// Among more names than this no similar one is looked for: the daemon has others to serve.
constexpr std::size_t kMaxCompared = 512;

Event about(EventKind kind, const OutputPort& port) {
  return {kind, {port.client->name}, {port.source->name}};
}

Event about(EventKind kind, const InputPort& port) {
  return {kind, {port.client->name}, {}, {port.name->name}};
}

}  // namespace

void Switchboard::tell_refusal(const LinkKey& key, shm::PortInstance to,
                               const std::string& why) const {
  const OutputPort& output = *outputs_.at(key.first);
  const InputPort& input = *inputs_.at(key.second);
  const bool to_output = to == key.first;
  wire::Message message;
  message.kind = wire::MessageKind::kConnectionRefused;
  message.port = to;
  message.peer = to_output ? key.second : key.first;
  message.id = to_output ? input.name->id : output.source->id;
  message.set_name(to_output ? input.name->name : output.source->name);
  message.set_text(why);
  client_of(to).send(message);
}

// The one that refuses knows it.
void Switchboard::refuse(shm::PortInstance port, shm::PortInstance peer, std::string why) {
  if (why.empty()) why = "its component gives no reason";
  if (const auto output = outputs_.find(port); output != outputs_.end()) {
    taps_.refuse(*output->second, peer, why);
  }
  for (const LinkKey& key : {LinkKey{port, peer}, LinkKey{peer, port}}) {
    const auto found = links_.find(key);
    if (found == links_.end()) continue;
    found->second.mismatch = why;
    if (std::exchange(found->second.number, 0) != 0) tell_refusal(key, peer, why);
    const OutputPort& output = *outputs_.at(key.first);
    const InputPort& input = *inputs_.at(key.second);
    log_event({EventKind::kMismatch,
               {output.client->name, input.client->name},
               {output.source->name},
               {input.name->name}},
              log::level::warn, "{} is not connected to {}: {}", output.source->name,
              input.name->name, why);
  }
}

std::string Switchboard::unmentioned_text(const shm::TableSnapshot& in_force,
                                          const std::string& name, bool is_output) const {
  const std::string what = is_output ? "none of these samples is delivered" : "no sample arrives";
  if (in_force.generation == 0) return "no model is in force, so " + what;
  std::vector<std::string_view> sources;
  std::vector<std::string_view> inputs;
  for (const auto& source : names_.sources()) {
    if (in_force.table.knows_source(source->id)) sources.push_back(source->name);
  }
  for (const auto& input : names_.inputs()) {
    if (in_force.table.knows_port(input->id)) inputs.push_back(input->name);
  }
  const auto& others = is_output ? inputs : sources;
  if (std::find(others.begin(), others.end(), name) != others.end()) {
    return "in the model in force " + name +
           (is_output ? " is an input port, and here it is open as an output port"
                      : " is an output port, and here it is open as an input port") +
           ", so " + what + "; `arbiter status` shows both";
  }
  auto& mentioned = is_output ? sources : inputs;
  if (mentioned.size() > kMaxCompared) mentioned.clear();
  return "the model in force does not mention " + name + ", so " + what +
         rules::advise(name, mentioned, "`arbiter status` shows the ports that it mentions");
}

template <class Port>
void Switchboard::say_unmentioned(Port& port, const std::string& text) {
  port.is_told_unmentioned = true;
  log_event(about(EventKind::kUnmentioned, port), log::level::warn, "{}: {}",
            port.client->description(), text);
  wire::Message message;
  message.kind = wire::MessageKind::kUnmentioned;
  message.port = port.instance;
  message.set_text(text);
  port.client->send(message);
}

void Switchboard::tell_unmentioned(const shm::TableSnapshot& in_force, shm::PortInstance port) {
  if (const auto found = outputs_.find(port); found != outputs_.end()) {
    OutputPort& output = *found->second;
    const bool is_mentioned = in_force.table.knows_source(output.source->id);
    if (is_mentioned) output.is_told_unmentioned = false;
    if (is_mentioned || output.is_told_unmentioned) return;
    say_unmentioned(output, unmentioned_text(in_force, output.source->name, true));
  }
  if (const auto found = inputs_.find(port); found != inputs_.end()) {
    InputPort& input = *found->second;
    const bool is_mentioned = in_force.table.knows_port(input.name->id);
    if (is_mentioned) input.is_told_unmentioned = false;
    if (is_mentioned || input.is_told_unmentioned) return;
    say_unmentioned(input, unmentioned_text(in_force, input.name->name, false));
  }
}

void Switchboard::tell_unmentioned(const shm::TableSnapshot& in_force) {
  for (const auto& [instance, output] : outputs_) tell_unmentioned(in_force, instance);
  for (const auto& [instance, input] : inputs_) tell_unmentioned(in_force, instance);
}

void Switchboard::tell_wrong_end(const shm::TableSnapshot& in_force, const Tap& tap) const {
  const auto is_among = [&](const auto& names, const auto& is_mentioned) {
    return std::any_of(names.begin(), names.end(), [&](const auto& each) {
      return each->name == tap.name && is_mentioned(each->id);
    });
  };
  const auto is_source = [&] {
    return is_among(names_.sources(),
                    [&](shm::SourceId id) { return in_force.table.knows_source(id); });
  };
  const auto is_input = [&] {
    return is_among(names_.inputs(), [&](shm::PortId id) { return in_force.table.knows_port(id); });
  };
  if (in_force.generation == 0) return;
  const bool is_wrong = tap.is_input ? !is_input() && is_source() : !is_source() && is_input();
  if (!is_wrong) return;
  const std::string text =
      "in the model in force " + tap.name +
      (tap.is_input ? " is an output port, and here it is tapped as an input port, so that nothing "
                      "comes; leave TapOf::input out"
                    : " is an input port, and here it is tapped as an output port, so that nothing "
                      "comes; write TapOf::input");
  log_event({EventKind::kUnmentioned, {tap.client->name}, {}, {tap.name}}, log::level::warn,
            "{}: {}", tap.client->description(), text);
  wire::Message message;
  message.kind = wire::MessageKind::kUnmentioned;
  message.port = tap.instance;
  message.set_text(text);
  tap.client->send(message);
}

void Switchboard::note_blind(shm::PortInstance port, const std::string& text) {
  const auto output = outputs_.find(port);
  const auto input = inputs_.find(port);
  bool& is_known =
      output != outputs_.end() ? output->second->is_known_blind : input->second->is_known_blind;
  if (std::exchange(is_known, true)) return;
  log_event(output != outputs_.end() ? about(EventKind::kBlind, *output->second)
                                     : about(EventKind::kBlind, *input->second),
            log::level::warn, "{}: {}", client_of(port).description(), text);
}

void Switchboard::describe(shm::PortInstance port, Description description) {
  if (const auto output = outputs_.find(port); output != outputs_.end()) {
    output->second->described = std::move(description);
  } else if (const auto input = inputs_.find(port); input != inputs_.end()) {
    input->second->described = std::move(description);
  }
}

void Switchboard::ask_to_yield(shm::PortInstance port, const std::string& who) {
  OutputPort& output = *outputs_.at(port);
  if (std::exchange(output.is_asked_to_yield, true)) return;
  wire::Message message;
  message.kind = wire::MessageKind::kYield;
  message.port = port;
  message.set_text(who);
  output.client->send(message);
  at_step("holder-asked-to-yield");
  log::info("{} is asked to yield output port {} to {}", output.client->description(),
            output.source->name, who);
}

}  // namespace arbiter::service
