#include "cli/why_elsewhere.hpp"

#include <cstdint>
#include <iostream>
#include <map>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <nlohmann/json.hpp>

#include "cli/broken_pipe.hpp"
#include "cli/live.hpp"
#include "cli/other_hosts.hpp"
#include "cli/why_report.hpp"
#include "cli/why_source.hpp"
#include "rules/explain/explain.hpp"
#include "rules/model/load.hpp"
#include "rules/text/names.hpp"
#include "shm/clock.hpp"
#include "shm/utf8.hpp"
#include "watch/model_in_force.hpp"
#include "watch/obstacles.hpp"
#include "watch/past.hpp"
#include "watch/port.hpp"
#include "wire/document.hpp"
#include "wire/link_call.hpp"
#include "wire/model_document.hpp"
#include "wire/status.hpp"

namespace arbiter::cli {
namespace {

using nlohmann::json;

// Both of one model: another may come into force between the two questions.
constexpr int kTries = 3;
// A link answers another one twenty times a second, whoever asks through it.
constexpr shm::Nanoseconds kWhyPeriod = 500'000'000;

std::string text_from(wire::LinkCall& link, const std::string& host, const char* verb) {
  // Those that are gone come last.
  const wire::HostAnswer answer = link.ask_hosts({host, verb, {}}).at(0);
  const std::string why_not = answer.why_not();
  if (!why_not.empty()) {
    throw wire::CallError("host " + host + ' ' + shm::printable(why_not));
  }
  return answer.text;
}

struct Elsewhere {
  wire::HostsDocument hosts;
  wire::Status status;
  watch::ModelInForce model;
};

Elsewhere ask(const std::string& instance, const std::string& host) {
  wire::LinkCall link(instance);
  Elsewhere there;
  there.hosts = wire::read_hosts(link.ask({"", "hosts", {}}));
  for (int tries = 0; tries < kTries; ++tries) {
    there.status = read_status_of_host(text_from(link, host, "status"));
    there.model = watch::ModelInForce(wire::read_model_document(text_from(link, host, "model")));
    if (there.status.model.generation == there.model.generation()) return there;
  }
  throw watch::WatchError("the model of host " + host + " changes again and again; ask again");
}

// Of each connection of the port what keeps it out; nothing where the daemon has no texts.
rules::PortExplanation explain(const Elsewhere& there, const std::string& port) {
  rules::PortExplanation explanation;
  if (!there.model.has_texts()) return explanation;
  rules::Diagnostics diagnostics;
  const rules::RuleSet rules =
      rules::load(there.model.texts(), diagnostics, rules::Keep::kProvenance);
  if (diagnostics.has_errors()) {
    throw watch::WatchError("this program cannot read that host's model; are both of one version?");
  }
  return rules::Explainer(rules).explain(port, [&](const std::string& source) {
    const wire::SourceStatus* const found = there.status.find_source(source);
    return found != nullptr && found->active;
  });
}

std::string component_text(const wire::Status& status, const std::string& source) {
  const wire::SourceStatus* const found = status.find_source(source);
  if (found == nullptr || !found->open) return "not open there";
  std::string text = found->open->component.node;
  if (found->open->described) text += ", comes from " + *found->open->described;
  return shm::printable(text);
}

// Of a port, or a source, that is left: who had it open last and died; empty: that is not known.
std::string death_there(const wire::Status& status, const watch::PortEnd& end, const auto* port) {
  if (!watch::is_vacant(port)) return {};
  const wire::DeathStatus* const death = watch::death_of(status, end, port->name);
  return death == nullptr ? "" : watch::death_text(*death, status.now);
}

std::string death_of_source(const wire::Status& status, const std::string& source) {
  return death_there(status, watch::kOutputEnd, status.find_source(source));
}

void write_death(std::ostream& out, const wire::Status& status, const std::string& source) {
  const std::string text = death_of_source(status, source);
  if (!text.empty()) out << "  ! " << text << '\n';
}

// Why nothing of the winner reaches the port; empty: something does.
std::string why_nothing_comes(const wire::Status& status, const wire::InputStatus& input) {
  if (!input.winner) return {};
  const watch::Sources unseen;
  const watch::Obstacles obstacles(status, input.name, unseen, {}, {});
  const std::string why = obstacles.why_nothing_comes_of(*input.winner);
  const std::string death = death_there(status, watch::kInputEnd, &input);
  return death.empty() ? why : why + "; " + death;
}

std::vector<std::string> causes_of(const rules::PortExplanation& explanation,
                                   const std::string& source) {
  for (const rules::ConnectionExplanation& each : explanation.connections) {
    if (each.source == source) return causes_in_short(each);
  }
  return {};
}

const wire::InputStatus& require_input(const Elsewhere& there, const WhyOptions& options,
                                       const std::string& host) {
  const std::string& port = options.port;
  if (const wire::InputStatus* const input = there.status.find_input(port)) return *input;
  const std::string none = "host " + host + " has no input port " + port;
  require_no_source(options, there.status, none);
  std::vector<std::string_view> known;
  for (const wire::InputStatus& each : there.status.inputs) known.push_back(each.name);
  throw watch::WatchError(none + rules::advise(port, known, "`arbiter status --all` lists them"));
}

// The answer may be about one source alone.
wire::InputStatus only(wire::InputStatus input, const std::string& source) {
  if (source.empty()) return input;
  const auto is_other = [&](const auto& each) { return each.source != source; };
  std::erase_if(input.connections, is_other);
  std::erase_if(input.senses, is_other);
  if (input.connections.empty() && input.senses.empty()) {
    throw watch::WatchError("there is no connection from " + source + " to " + input.name +
                            " there, and its rules do not read it");
  }
  return input;
}

bool is_open_there(const wire::InputStatus& input) { return input.open || input.away_pid; }

json text_or_null(const std::string& text) { return text.empty() ? json(nullptr) : json(text); }

void write_where_it_is_open(std::ostream& out, const Elsewhere& there,
                            const wire::InputStatus& input, const std::string& host) {
  const bool is_open = is_open_there(input);
  if (!is_open && !input.winner) {
    out << "  ! no component there has the port open: nothing is taken\n";
  }
  write_others_with_port(out, input.name, is_open, others_with_port(input.name, there.hosts, host));
}

void write_text(std::ostream& out, const Elsewhere& there, const wire::InputStatus& input,
                const std::string& host) {
  const rules::PortExplanation explanation = explain(there, input.name);
  const wire::HostStatus* const found = there.hosts.find_host(host);
  out << input.name << (is_open_there(input) ? " is decided on host " : " is not open on host ")
      << host << ", round trip "
      << round_trip_text(found == nullptr ? std::nullopt : found->round_trip) << ", by "
      << shm::printable(there.model.text()) << '\n';
  if (!input.arbitrated) {
    out << "  not arbitrated: everything is delivered\n";
  } else if (input.cannot_deliver) {
    out << "  " << input.cannot_deliver->source
        << " is selected, but cannot deliver: " << shm::printable(input.cannot_deliver->why)
        << '\n';
  } else {
    const std::string why = why_nothing_comes(there.status, input);
    out << "  " << (input.winner ? *input.winner + " wins" : "idle: no connection wins")
        << (why.empty() ? "" : "; but nothing of it reaches the port: " + why) << '\n';
  }
  write_where_it_is_open(out, there, input, host);
  for (const wire::ConnectionStatus& each : input.connections) {
    out << '\n'
        << each.source << "  " << (each.active ? "active" : "inactive")
        << (each.winner ? ", wins" : "") << "  [" << component_text(there.status, each.source)
        << "]\n";
    for (const std::string& cause : causes_of(explanation, each.source)) {
      out << "  " << shm::printable(cause) << '\n';
    }
    write_death(out, there.status, each.source);
  }
  for (const wire::SensedStatus& each : input.senses) {
    out << '\n'
        << each.source << "  " << (each.active ? "active" : "inactive") << ", sensed  ["
        << component_text(there.status, each.source) << "]\n";
    write_death(out, there.status, each.source);
  }
}

json json_of(const Elsewhere& there, const wire::InputStatus& input, const std::string& host) {
  const rules::PortExplanation explanation = explain(there, input.name);
  const wire::HostStatus* const found = there.hosts.find_host(host);
  json document = {{"port", input.name},
                   {"host", host},
                   {"round_trip_ns", nullptr},
                   {"generation", there.model.generation()},
                   {"arbitrated", input.arbitrated},
                   {"open", is_open_there(input)},
                   {"also_open_on", others_with_port(input.name, there.hosts, host)},
                   {"winner", text_or_null(input.winner.value_or(""))},
                   {"nothing_comes_of_it", text_or_null(why_nothing_comes(there.status, input))},
                   {"connections", json::array()},
                   {"senses", json::array()}};
  if (found != nullptr && found->round_trip) document["round_trip_ns"] = *found->round_trip;
  for (const wire::ConnectionStatus& each : input.connections) {
    document["connections"].push_back(
        {{"source", each.source},
         {"active", each.active},
         {"wins", each.winner},
         {"component", component_text(there.status, each.source)},
         {"death", text_or_null(death_of_source(there.status, each.source))},
         {"causes", causes_of(explanation, each.source)}});
  }
  for (const wire::SensedStatus& each : input.senses) {
    document["senses"].push_back(
        {{"source", each.source},
         {"active", each.active},
         {"death", text_or_null(death_of_source(there.status, each.source))}});
  }
  return document;
}

// What a change of the winner is made of, as far as two answers show it.
struct SeenPort {
  wire::InputStatus input;  // of one that is gone: neither mentioned nor open
  std::uint64_t generation = 0;

  [[nodiscard]] std::string winner() const {
    if (generation == 0) return "no model";
    if (!input.mentioned) return "not mentioned";
    return !input.arbitrated ? "not arbitrated" : input.winner.value_or("idle");
  }
  [[nodiscard]] std::map<std::string, bool> activities() const {
    std::map<std::string, bool> active;
    for (const auto& each : input.connections) active[each.source] = each.active;
    for (const auto& each : input.senses) active[each.source] = each.active;
    return active;
  }
};

SeenPort seen_in(const wire::Status& status, const std::string& port) {
  const wire::InputStatus* const input = status.find_input(port);
  return {input == nullptr ? wire::InputStatus{} : *input, status.model.generation};
}

// The sources that are active and were not, or the other way round.
std::map<std::string, bool> changed_activities(const SeenPort& before, const SeenPort& now) {
  const auto old = before.activities();
  auto changed = now.activities();
  std::erase_if(changed, [&](const auto& each) {
    const auto was = old.find(each.first);
    return was == old.end() || was->second == each.second;
  });
  return changed;
}

std::string difference(const SeenPort& before, const SeenPort& now) {
  std::string text;
  if (before.generation != now.generation) {
    text = "model " + std::to_string(now.generation) + " came into force";
  }
  for (const auto& [source, is_active] : changed_activities(before, now)) {
    text += (text.empty() ? "" : " and ") + source +
            (is_active ? " became active" : " became inactive");
  }
  return text.empty() ? "something happened between two looks" : text;
}

// As why --follow has it of a port of this host; null: what only that host could say.
json line_of_change(const SeenPort& before, const SeenPort& now) {
  json because = json::array();
  for (const auto& [source, is_active] : changed_activities(before, now)) {
    because.push_back(
        {{"source", source}, {"became", is_active ? "active" : "inactive"}, {"at_ns", nullptr}});
  }
  const bool is_new_model = before.generation != now.generation;
  return {{"old", text_or_null(before.input.winner.value_or(""))},
          {"because", std::move(because)},
          {"model", is_new_model ? json(now.generation) : json(nullptr)},
          {"old_loses", nullptr}};
}

class FollowerElsewhere {
 public:
  FollowerElsewhere(const WhyOptions& options, std::string host)
      : options_(options), host_(std::move(host)) {
    Elsewhere there;
    there.status = status();
    last_ = {require_input(there, options_, host_), there.status.model.generation};
    write(last_, nullptr);
    if (options_.json) return;
    there.hosts = hosts_if_linked(options_.instance).value_or(wire::HostsDocument{});
    write_where_it_is_open(std::cout, there, last_.input, host_);
    std::cout << std::flush;
  }

  int run(const shm::FileDescriptor& interrupts) {
    std::uint64_t changes = 0;
    while (std::cout && !has_reader_gone()) {
      if (sleep_until(shm::monotonic_now() + kWhyPeriod, interrupts)) return 0;
      try {
        SeenPort now = seen_in(status(), options_.port);
        say("host " + host_ + " answers");
        if (now.winner() != last_.winner()) {
          write(now, &last_);
          if (++changes == options_.count) return 0;
        }
        last_ = std::move(now);
      } catch (const std::runtime_error& error) {  // it may come back
        say(error.what());
      }
    }
    return 0;
  }

 private:
  // By a call of its own: a link that joins its network again hangs up.
  [[nodiscard]] wire::Status status() const {
    wire::LinkCall link(options_.instance);
    return read_status_of_host(text_from(link, host_, "status"));
  }

  void say(const std::string& text) {
    if (std::exchange(said_, text) == text) return;
    std::cerr << "arbiter: " << text << '\n';
  }

  void write(const SeenPort& now, const SeenPort* before) const {
    const shm::Nanoseconds at = shm::monotonic_now();
    if (options_.json) {
      json line = {{"at_ns", at},
                   {"port", options_.port},
                   {"host", host_},
                   {"open", is_open_there(now.input)},
                   {"mentioned", now.input.mentioned},
                   {"arbitrated", now.input.arbitrated},
                   {"winner", text_or_null(now.input.winner.value_or(""))}};
      if (before != nullptr) line.update(line_of_change(*before, now));
      std::cout << line.dump(-1, ' ', false, json::error_handler_t::replace) << std::endl;
      return;
    }
    std::cout << seconds_text(at - started_) << "  ";
    if (before == nullptr) {
      std::cout << options_.port
                << (is_open_there(now.input) ? " on host " : " is not open on host ") << host_
                << ": " << now.winner() << ", by model " << now.generation
                << "; asked twice a second" << std::endl;
    } else {
      std::cout << before->winner() << " -> " << now.winner() << "  because "
                << difference(*before, now) << std::endl;
    }
  }

  const WhyOptions& options_;
  const std::string host_;
  const shm::Nanoseconds started_ = shm::monotonic_now();
  SeenPort last_;
  std::string said_ = "host " + host_ + " answers";
};

}  // namespace

int follow_elsewhere(const WhyOptions& options, const std::string& host) {
  const shm::FileDescriptor interrupts = catch_interrupts();
  return FollowerElsewhere(options, host).run(interrupts);
}

void write_why_elsewhere(std::ostream& out, const WhyOptions& options, const std::string& host) {
  const Elsewhere there = ask(options.instance, host);
  const wire::InputStatus input = only(require_input(there, options, host), options.source);
  if (options.json) {
    out << wire::write_document(json_of(there, input, host));
  } else {
    write_text(out, there, input, host);
  }
}

}  // namespace arbiter::cli
