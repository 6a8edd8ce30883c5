// arbiter why: who wins at a port and since when, and what keeps each other connection out.
//
// The daemon only hands out the texts of the model in force. What is active is read where the
// decisions read it, in the activity pages, and explained here.
#include <algorithm>
#include <fstream>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/live_port.hpp"
#include "cli/verbs.hpp"
#include "rules/change.hpp"
#include "rules/names.hpp"
#include "rules/tenure.hpp"
#include "shm/clock.hpp"

namespace arbiter::cli {
namespace {

using nlohmann::json;

// How often --follow looks, beside the times at which it knows that an activity ends: publishers do
// not ring for those who merely observe.
constexpr shm::Nanoseconds kLookEvery = 2'000'000;

struct WhyOptions {
  std::string port;
  std::string source;
  std::string instance;
  bool follow = false;
  bool json = false;
  std::uint64_t count = 0;  // of changes; 0: until interrupted
};

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

// What besides the rules keeps samples from getting through: what the daemon's status knows.
class Obstacles {
 public:
  Obstacles(const json& status, const std::string& port)
      : status_(status), input_(find_named(status.at("inputs"), "name", port)) {}

  [[nodiscard]] std::vector<std::string> of_port() const {
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

  [[nodiscard]] std::vector<std::string> of_connection(const std::string& source) const {
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
    say("waiting", " samples wait to be taken");
    if (count("accepted") != 0 && count("taken") + count("dropped") + count("overtaken") == 0) {
      result.push_back("the component has not taken any of the " +
                       std::to_string(count("accepted")) + " accepted samples");
    }
    return result;
  }

 private:
  void add_publisher(const std::string& source, std::vector<std::string>& result) const {
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

  const json& status_;
  const json* input_;
};

std::string names_of(const LivePort& port, const std::vector<shm::SourceId>& sources,
                     const Look& look) {
  std::string text;
  for (const shm::SourceId source : sources) {
    const std::string name = port.source_name(source);
    if (!text.empty()) text += " and ";
    text += event_text(name, look.sources.state(name), look.sources.now());
  }
  return text;
}

class Answer {
 public:
  Answer(const WhyOptions& options, LivePort& port, Look look, rules::PortExplanation explanation,
         const json& status)
      : options_(options),
        port_(port),
        look_(std::move(look)),
        explanation_(std::move(explanation)),
        obstacles_(status, port.name()),
        tenure_(
            rules::tenure_of(look_.snapshot.table, port.id(), look_.winner,
                             {look_.sources.now(), port.in_force_since(),
                              [this](shm::SourceId source) { return look_.words.at(source); }})) {
    const auto is_other = [&](const auto& each) { return each.source != options_.source; };
    shown_ = explanation_.connections;
    if (!options_.source.empty()) std::erase_if(shown_, is_other);
  }

  // Throws Error where the source is none of this port's.
  void check_source() const {
    if (options_.source.empty() || !shown_.empty() || is_sensed()) return;
    std::vector<std::string_view> known;
    for (const auto& each : explanation_.connections) known.push_back(each.source);
    for (const auto& each : explanation_.senses) known.push_back(each);
    throw Error("there is no connection from " + options_.source + " to " + port_.name() +
                ", and its rules do not read it" +
                rules::advise(options_.source, known,
                              "a behaviour's <config> or a <select> makes a connection"));
  }

  void write_text() const {
    write_port();
    for (const auto& each : shown_) write_connection(each);
    if (is_sensed()) write_sensed(options_.source);
    if (options_.source.empty()) {
      for (const auto& source : explanation_.senses) write_sensed(source);
    }
  }

  void write_json() const {
    json document = {
        {"port", port_.name()},
        {"at_ns", look_.sources.now()},
        {"settled", look_.is_settled},
        {"model",
         {{"generation", look_.snapshot.generation}, {"provenance_known", port_.has_texts()}}},
        {"arbitrated", look_.is_arbitrated},
        {"winner", explanation_.winner ? json(*explanation_.winner) : json(nullptr)},
        {"since", nullptr},
        {"obstacles", obstacles_.of_port()},
        {"connections", json::array()},
        {"senses", json::array()}};
    if (look_.is_arbitrated) document["since"] = since_json();
    for (const auto& each : shown_) {
      json connection = connection_json(each, look_.sources);
      connection["obstacles"] = obstacles_.of_connection(each.source);
      document["connections"].push_back(std::move(connection));
    }
    for (const auto& source : explanation_.senses) {
      if (!options_.source.empty() && source != options_.source) continue;
      document["senses"].push_back(look_.sources.to_json(source));
    }
    std::cout << document.dump(2, ' ', false, json::error_handler_t::replace) << '\n';
  }

 private:
  [[nodiscard]] bool is_sensed() const {
    const auto& senses = explanation_.senses;
    return std::find(senses.begin(), senses.end(), options_.source) != senses.end();
  }

  void write_port() const {
    std::cout << port_.name();
    if (!look_.is_mentioned) {
      std::cout << ": the model in force does not mention it, so that no connection leads to it\n";
    } else if (!look_.is_arbitrated) {
      std::cout << ": not arbitrated, for no rule mentions it; all that its connections bring is "
                   "delivered\n";
    } else {
      std::cout << ": "
                << (explanation_.winner ? *explanation_.winner + " wins"
                                        : std::string("idle, nobody wins"))
                << since_text() << '\n';
    }
    for (const auto& each : obstacles_.of_port()) std::cout << "  ! " << each << '\n';
    if (!look_.is_settled) {
      std::cout << "  ! sources change faster than they can be looked at: this may be of several "
                   "moments\n";
    }
    if (look_.is_arbitrated && !port_.has_texts()) {
      std::cout
          << "  ! the daemon has this model from its predecessor, and knows its decisions, but "
             "not whose behaviours they come from (started without --model)\n";
    }
  }

  [[nodiscard]] std::string since_text() const {
    const shm::Nanoseconds now = look_.sources.now();
    if (tenure_.is_exact()) {
      return ", since " + span_text(now - tenure_.at_least) +
             " ago: " + names_of(port_, tenure_.changed, look_);
    }
    if (tenure_.at_least != 0 && tenure_.at_least == port_.in_force_since()) {
      return ", since the model came into force " + span_text(now - tenure_.at_least) + " ago";
    }
    std::string text;
    if (tenure_.at_least != 0) text += ", for at least " + span_text(now - tenure_.at_least);
    if (tenure_.not_before) {
      text += text.empty() ? ", " : "; ";
      text += "at the earliest since " + span_text(now - *tenure_.not_before) +
              " ago: " + names_of(port_, tenure_.changed, look_);
    } else if (tenure_.at_least == 0) {
      text += ": nothing has ever happened here";
    }
    return text;
  }

  [[nodiscard]] json since_json() const {
    json changed = json::array();
    for (const shm::SourceId source : tenure_.changed) {
      const std::string name = port_.source_name(source);
      changed.push_back(event_json(name, look_.sources.state(name), look_.sources.now()));
    }
    return {{"exact", tenure_.is_exact()},
            {"at_least_ns", tenure_.at_least},
            {"not_before_ns", tenure_.not_before ? json(*tenure_.not_before) : json(nullptr)},
            {"changed", std::move(changed)}};
  }

  void write_connection(const rules::ConnectionExplanation& connection) const {
    std::cout << '\n' << connection.source;
    if (!look_.is_arbitrated) {
      std::cout << " is delivered\n  it is " << look_.sources.describe(connection.source) << '\n';
    } else if (connection.wins) {
      std::cout << " wins\n  " << look_.sources.describe(connection.source) << '\n';
      for (const auto& part : connection.parts) {
        if (!part.causes.empty()) continue;
        std::cout << "  selected by "
                  << (part.behaviour ? describe(*part.behaviour) : std::string("its rule"));
        if (!part.where.file.empty()) {
          std::cout << " (" << part.where.file << ':' << part.where.line << ')';
        }
        std::cout << '\n';
      }
    } else {
      std::cout << " is kept out\n";
      write_causes(std::cout, connection, look_.sources);
    }
    for (const auto& each : obstacles_.of_connection(connection.source)) {
      std::cout << "  ! " << each << '\n';
    }
  }

  void write_sensed(const std::string& source) const {
    std::cout << '\n'
              << source << " is sensed: the rules read it, but it has no connection here\n  "
              << look_.sources.describe(source) << '\n';
  }

  const WhyOptions& options_;
  const LivePort& port_;
  const Look look_;
  const rules::PortExplanation explanation_;
  const Obstacles obstacles_;
  const rules::Tenure tenure_;
  std::vector<rules::ConnectionExplanation> shown_;
};

int answer(const WhyOptions& options) {
  const auto node = connect("why", options.instance);
  LivePort port(node, options.port);
  for (;;) {
    Look look = port.look();
    auto explanation = port.explain(look);
    if (!explanation) continue;  // another model has come into force
    const json status = fetch_status(*node);
    const Answer answer(options, port, std::move(look), std::move(*explanation), status);
    answer.check_source();
    options.json ? answer.write_json() : answer.write_text();
    return 0;
  }
}

class Follower {
 public:
  Follower(const WhyOptions& options, shm::FileDescriptor interrupts)
      : options_(options),
        interrupts_(std::move(interrupts)),
        port_(connect("why", options.instance), options.port),
        started_(shm::monotonic_now()),
        last_(port_.look()) {}

  int run() {
    write_start();
    std::uint64_t changes = 0;
    while (std::cout) {
      const shm::Nanoseconds soon = shm::monotonic_now() + kLookEvery;
      if (sleep_until(std::min(soon, last_.next_end()), interrupts_)) return 0;
      Look look = port_.look();
      if (look.winner != last_.winner || look.is_arbitrated != last_.is_arbitrated) {
        if (!write_change(look)) continue;
        if (++changes == options_.count) return 0;
      }
      last_ = std::move(look);
    }
    return 0;
  }

 private:
  [[nodiscard]] std::string name_of(const Look& look) const {
    if (!look.is_arbitrated) return "not arbitrated";
    return look.winner == shm::kNone ? "idle" : port_.source_name(look.winner);
  }
  [[nodiscard]] json winner_json(const Look& look) const {
    return look.winner == shm::kNone ? json(nullptr) : json(port_.source_name(look.winner));
  }

  void write_start() const {
    if (options_.json) {
      write_line({{"at_ns", last_.sources.now()},
                  {"port", port_.name()},
                  {"arbitrated", last_.is_arbitrated},
                  {"winner", winner_json(last_)}});
      return;
    }
    std::cout << seconds_text(last_.sources.now() - started_) << "  " << port_.name() << ": "
              << name_of(last_) << std::endl;
  }

  static void write_line(const json& line) {
    std::cout << line.dump(-1, ' ', false, json::error_handler_t::replace) << std::endl;
  }

  // False: another model has come into force meanwhile, and it must be looked at again.
  bool write_change(const Look& look) {
    const auto explanation = port_.explain(look);
    if (!explanation) return false;
    const bool is_new_model = look.snapshot.generation != last_.snapshot.generation;
    const auto causes = rules::causes_of_change(
        look.snapshot.table, port_.id(),
        [&](shm::SourceId source) { return last_.is_active(source); },
        [&](shm::SourceId source) { return look.is_active(source); });
    // What has happened has happened before it was seen.
    shm::Nanoseconds at = look.sources.now();
    for (const shm::SourceId source : causes) {
      at = std::min(at,
                    event_time(look.sources.state(port_.source_name(source)), look.sources.now()));
    }
    if (is_new_model) at = port_.in_force_since() != 0 ? port_.in_force_since() : at;
    std::string because;
    if (is_new_model) {
      because = "model " + std::to_string(look.snapshot.generation) + " came into force";
    }
    if (!causes.empty() && !is_new_model) because = names_of(port_, causes, look);
    const std::string loser = loss_text(*explanation, name_of(last_), look.sources);
    if (options_.json) {
      json events = json::array();
      for (const shm::SourceId source : causes) {
        const std::string name = port_.source_name(source);
        events.push_back(event_json(name, look.sources.state(name), look.sources.now()));
      }
      write_line({{"at_ns", at},
                  {"port", port_.name()},
                  {"arbitrated", look.is_arbitrated},
                  {"old", winner_json(last_)},
                  {"winner", winner_json(look)},
                  {"because", std::move(events)},
                  {"model", is_new_model ? json(look.snapshot.generation) : json(nullptr)},
                  {"old_loses", loser.empty() ? json(nullptr) : json(loser)}});
      return true;
    }
    std::cout << seconds_text(at - started_) << "  " << name_of(last_) << " -> " << name_of(look)
              << "  because " << because
              << (loser.empty() ? "" : "; " + name_of(last_) + " is " + loser) << std::endl;
    return true;
  }

  const WhyOptions& options_;
  const shm::FileDescriptor interrupts_;
  LivePort port_;
  const shm::Nanoseconds started_;
  Look last_;
};

int why(const WhyOptions& options) {
  if (!options.follow) return answer(options);
  return Follower(options, catch_interrupts()).run();
}

}  // namespace

void add_why(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<WhyOptions>();
  CLI::App* verb = app.add_subcommand(
      "why", "Tell who wins at an input port, since when, and what keeps the others out");
  verb->add_option("PORT", options->port, "An input port's name")->required();
  auto* source = verb->add_option(
      "SOURCE", options->source, "Of the connections to the port, tell of this output port's only");
  auto* follow = verb->add_flag("--follow", options->follow,
                                "Print each change of the winner, and its cause, as it comes");
  source->excludes(follow);
  verb->add_option("--count", options->count, "With --follow: end after so many changes")
      ->type_name("N")
      ->needs(follow)
      ->check(CLI::PositiveNumber);
  verb->add_flag("--json", options->json, "As JSON; with --follow one object a line");
  add_instance_option(*verb, options->instance);
  verb->footer(
      "Example:\n"
      "  arbiter why /Gaze/pos:i\n"
      "  arbiter why /Gaze/pos:i /Face/pos:o\n"
      "  arbiter why /Gaze/pos:i --follow\n\n"
      "Exit code: 0 answered, whoever wins; 1 no daemon, no such port, no such source, or not\n"
      "allowed to observe; 2 wrong use.");
  verb->callback([options, &exit_code] { exit_code = why(*options); });
}

}  // namespace arbiter::cli
