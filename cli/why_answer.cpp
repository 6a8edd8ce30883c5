#include "cli/why_answer.hpp"

#include <algorithm>
#include <cstddef>
#include <ostream>
#include <string_view>
#include <utility>

#include "cli/model_report.hpp"
#include "cli/name_warnings.hpp"
#include "cli/other_hosts.hpp"
#include "cli/why_imports.hpp"
#include "cli/why_report.hpp"
#include "cli/why_source.hpp"
#include "cli/why_summary.hpp"
#include "rules/text/names.hpp"
#include "watch/slow_publishers.hpp"

namespace arbiter::cli {
namespace {

using nlohmann::json;
using rules::ConnectionExplanation;
using watch::Look;
using watch::ModelInForce;

// Of ports with more connections than this, inactive ones are told of in short.
constexpr std::size_t kMaxTold = 8;
// Where there is something to say of more than kMaxTold: of so many it is said one by one.
constexpr std::size_t kMaxTakenApart = 3;

bool is_open_in(const wire::Status& status, const std::string& port) {
  const wire::InputStatus* const input = status.find_input(port);
  return input != nullptr && (input->open || input->away_pid);
}

// The winner first, then who would like to win.
int rank(const ConnectionExplanation& connection) {
  return connection.wins ? 0 : connection.is_active ? 1 : 2;
}

}  // namespace

WhyAnswer::WhyAnswer(const WhyOptions& options, const watch::Port& port, Look look,
                     rules::PortExplanation explanation, const wire::Status& status,
                     watch::Fates fates, std::vector<std::string> also_open_on, std::ostream& out)
    : out_(out),
      options_(options),
      port_(port),
      look_(std::move(look)),
      explanation_(std::move(explanation)),
      obstacles_(status, port.name(), look_.sources, port.known_sources(), port.known_ports(),
                 std::move(fates)),
      also_open_on_(std::move(also_open_on)),
      is_open_(is_open_in(status, port.name())),
      tenure_(
          rules::tenure_of(look_.table(), port.id(), look_.winner,
                           {look_.sources.now(), port.model().since(port.name()),
                            [this](shm::SourceId source) {
                              const auto& words = look_.picture.words;
                              const auto word = words.find(source);  // none: it is torn
                              return word == words.end() ? shm::kNeverActive : word->second;
                            },
                            [this](shm::SourceId source) {
                              return look_.sources.state(port_.source_name(source)).arrived_by();
                            },
                            [this](shm::SourceId source) {
                              return look_.sources.state(port_.source_name(source)).began;
                            }})),
      shown_(explanation_.connections) {
  const auto is_other = [&](const auto& each) { return each.source != options_.source; };
  if (!options_.source.empty()) std::erase_if(shown_, is_other);
  for (const auto& each : shown_) {
    if (!each.is_active || each.wins) continue;
    for (auto& name : sources_that_matter(each)) reasons_.push_back(std::move(name));
  }
}

bool WhyAnswer::is_sensed(const std::string& source) const {
  const auto& senses = explanation_.senses;
  return std::find(senses.begin(), senses.end(), source) != senses.end();
}

void WhyAnswer::check_source(const wire::Status& status) const {
  if (options_.source.empty() || !shown_.empty() || is_sensed(options_.source)) return;
  std::vector<std::string_view> known;
  for (const auto& each : explanation_.connections) known.push_back(each.source);
  for (const auto& each : explanation_.senses) known.push_back(each);
  const ModelInForce& model = port_.model();
  const auto other = model.other_that_mentions(port_.name(), options_.source);
  const bool is_input = status.find_input(options_.source) != nullptr &&
                        status.find_source(options_.source) == nullptr;
  const std::string advice =
      other      ? "; model \"" + *other + "\" has it: arbiter switch " + *other
      : is_input ? "; it is an input port: name an output port behind " + port_.name()
                 : rules::advise(options_.source, known,
                                 "a behaviour's <config> or a <select> makes a connection");
  throw watch::WatchError("there is no connection from " + options_.source + " to " + port_.name() +
                          ", and its rules do not read it, in " + model.text() +
                          ", which is in force" + advice);
}

bool WhyAnswer::is_only_named(const std::string& source) const {
  return options_.source.empty() && !options_.all && obstacles_.is_out_of_use(source) &&
         std::find(reasons_.begin(), reasons_.end(), source) == reasons_.end();
}

bool WhyAnswer::is_large() const {
  return options_.source.empty() && !options_.all && shown_.size() > kMaxTold;
}

bool WhyAnswer::is_short(const ConnectionExplanation& connection) const {
  return is_large() && connection.has_rule && !connection.is_active;
}

void WhyAnswer::write_text() const {
  write_port();
  auto sorted = shown_;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return rank(a) < rank(b); });
  std::vector<const ConnectionExplanation*> told;
  for (const auto& each : sorted) {
    if (!each.has_rule || !is_only_named(each.source)) told.push_back(&each);
  }
  std::vector<const ConnectionExplanation*> rest;
  if (is_large() && look_.is_arbitrated && told.size() > kMaxTold) {
    rest.assign(told.begin() + kMaxTakenApart, told.end());
    told.resize(kMaxTakenApart);
  }
  for (const auto* each : told) write_connection(*each);
  if (!rest.empty()) write_rest(rest);
  if (is_sensed(options_.source)) write_sensed(options_.source);
  if (!options_.source.empty()) return;
  write_senses();
  write_only_named();
}

void WhyAnswer::write_rest(const std::vector<const ConnectionExplanation*>& rest) const {
  write_summary(out_, rest);
  std::vector<std::string> obstructed;
  for (const auto* each : rest) {
    const auto obstacles = obstacles_.of_connection(each->source);
    const bool is_obstructed = std::any_of(obstacles.begin(), obstacles.end(),
                                           [](const auto& one) { return one.is_wrong; });
    if (is_obstructed) obstructed.push_back(each->source);
  }
  if (!obstructed.empty()) {
    out_ << "  ! there is more to say about " << rules::enumerate(obstructed) << '\n';
  }
  out_ << "\narbiter why " << port_.name() << " SOURCE shows one of them, --all shows all\n";
}

void WhyAnswer::write_senses() const {
  std::vector<std::string> told;
  for (const auto& source : explanation_.senses) {
    if (!is_only_named(source)) told.push_back(source);
  }
  if (options_.all || told.size() <= kMaxTold) {
    for (const auto& source : told) write_sensed(source);
    return;
  }
  std::vector<std::string> active, inactive;
  for (const auto& source : told) {
    (look_.sources.is_active(source) ? active : inactive).push_back(source);
  }
  out_ << "\nSensed, without a connection here:\n";
  if (!active.empty()) {
    out_ << "  " << active.size() << " active: " << rules::enumerate(active) << '\n';
  }
  if (!inactive.empty()) {
    out_ << "  " << inactive.size() << " inactive: " << rules::enumerate(inactive) << '\n';
  }
}

void WhyAnswer::write_only_named() const {
  std::vector<std::string> names;
  for (const auto& each : shown_) {
    if (each.has_rule) names.push_back(each.source);
  }
  names.insert(names.end(), explanation_.senses.begin(), explanation_.senses.end());
  std::erase_if(names, [this](const std::string& source) { return !is_only_named(source); });
  if (names.empty()) return;
  out_ << "\nNever active (no component has them open): " << rules::enumerate(names)
       << (names.size() > rules::kMaxNamesInWords ? " (--all shows all)" : "") << '\n';
}

json WhyAnswer::component_json(const std::string& source) const {
  const std::string component = obstacles_.component_of(source);
  return component.empty() ? json(nullptr) : json(component);
}

void WhyAnswer::write_json() const {
  const json selected = explanation_.winner ? json(*explanation_.winner) : json(nullptr);
  const bool is_useless =
      explanation_.winner && !obstacles_.why_it_cannot_deliver(*explanation_.winner).empty();
  json document = {{"port", port_.name()},
                   {"at_ns", look_.sources.now()},
                   {"settled", look_.picture.is_settled},
                   {"model", model_json(port_.model())},
                   {"arbitrated", look_.is_arbitrated},
                   {"mentioned", look_.is_mentioned},
                   {"selected", selected},
                   {"winner", is_useless ? json(nullptr) : selected},
                   {"nothing_comes_of_it", nullptr},
                   {"since", nullptr},
                   {"obstacles", obstacles_json(obstacles_.of_port())},
                   {"also_open_on", also_open_on_},
                   {"connections", json::array()},
                   {"senses", json::array()},
                   {"warnings", to_json(name_warnings(port_.diagnostics()))}};
  if (look_.is_arbitrated) document["since"] = since_json();
  if (explanation_.winner) {
    const std::string why = is_useless ? obstacles_.why_it_cannot_deliver(*explanation_.winner)
                                       : obstacles_.why_nothing_comes_of(*explanation_.winner);
    if (!why.empty()) document["nothing_comes_of_it"] = why;
  }
  for (const auto& each : shown_) {
    json connection = connection_json(each, look_.sources);
    connection["component"] = component_json(each.source);
    connection["obstacles"] = obstacles_json(obstacles_.of_connection(each.source));
    document["connections"].push_back(std::move(connection));
  }
  for (const auto& source : explanation_.senses) {
    if (!options_.source.empty() && source != options_.source) continue;
    json sensed = activity_json(look_.sources, source);
    sensed["component"] = component_json(source);
    sensed["obstacles"] = obstacles_json(obstacles_.of_source(source));
    document["senses"].push_back(std::move(sensed));
  }
  out_ << document.dump(2, ' ', false, json::error_handler_t::replace) << '\n';
}

void write_why(std::ostream& out, const WhyOptions& options,
               const std::shared_ptr<watch::Instance>& instance, const watch::KeptPicture* kept,
               const wire::HostsDocument* hosts, std::shared_ptr<watch::ModelLoader> models) {
  require_no_source(options, *instance);
  watch::Port port(instance, options.port, std::move(models));
  for (;;) {
    Look look = kept == nullptr ? port.look() : port.look_back(*kept);
    auto explanation = port.explain(look);
    if (!explanation) continue;  // another model has come into force: that is rare
    port.add_timeouts(look);
    const wire::Status status = instance->status();
    if (kept == nullptr) watch::add_gaps(port, look, status);
    watch::Fates fates;
    std::vector<std::string> also_open_on;
    if (hosts != nullptr) {
      fates = fates_elsewhere(options, status, *hosts);
      also_open_on = others_with_port(options.port, *hosts, hosts->host);
    }
    const shm::TableSnapshot snapshot = look.picture.snapshot;
    const WhyAnswer answer(options, port, std::move(look), std::move(*explanation), status,
                           std::move(fates), std::move(also_open_on), out);
    if (!port.is_whole(snapshot)) continue;  // later models have its place
    answer.check_source(status);
    if (options.json) {
      answer.write_json();
    } else {
      answer.write_text();
      write_text(out, name_warnings(port.diagnostics()));
      if (hosts != nullptr) write_imports_of(out, options.port, status, *hosts, *instance);
    }
    return;
  }
}

}  // namespace arbiter::cli
