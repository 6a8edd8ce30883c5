// arbiter why: who wins at a port and since when, and what keeps each other connection out.
//
// The daemon only hands out the texts of the model in force. What is active is read where the
// decisions read it, in the activity pages, and explained here.
#include <algorithm>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/live_port.hpp"
#include "cli/obstacles.hpp"
#include "cli/verbs.hpp"
#include "cli/why_follow.hpp"
#include "rules/names.hpp"
#include "rules/tenure.hpp"

namespace arbiter::cli {
namespace {

using nlohmann::json;

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
             " ago: " + events_text(port_, tenure_.changed, look_);
    }
    if (tenure_.at_least != 0 && tenure_.at_least == port_.in_force_since()) {
      return ", since the model came into force " + span_text(now - tenure_.at_least) + " ago";
    }
    std::string text;
    if (tenure_.at_least != 0) text += ", for at least " + span_text(now - tenure_.at_least);
    if (tenure_.not_before) {
      text += text.empty() ? ", " : "; ";
      text += "at the earliest since " + span_text(now - *tenure_.not_before) +
              " ago: " + events_text(port_, tenure_.changed, look_);
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
    if (!explanation) continue;  // another model has come into force: that is rare
    const json status = fetch_status(*node);
    const Answer answer(options, port, std::move(look), std::move(*explanation), status);
    answer.check_source();
    options.json ? answer.write_json() : answer.write_text();
    return 0;
  }
}

int why(const WhyOptions& options) {
  if (!options.follow) return answer(options);
  return follow_winners(options);
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
