#include "cli/why_report.hpp"

#include <algorithm>
#include <cstdio>
#include <optional>
#include <set>

#include "rules/text/duration.hpp"
#include "rules/text/names.hpp"
#include "shm/utf8.hpp"

namespace arbiter::cli {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxNamed = 4;

json place_json(const rules::Location& where) {
  if (where.file.empty()) return nullptr;
  return {{"file", where.file}, {"line", where.line}, {"column", where.column}};
}

json element_json(const std::optional<rules::Element>& element) {
  if (!element) return nullptr;
  return {{"name", element->name},
          {"kind", element->is_meta ? "meta-behaviour" : "behaviour"},
          {"where", place_json(element->where)}};
}

json literals_json(const std::vector<rules::Literal>& literals) {
  json result = json::array();
  for (const auto& each : literals) {
    result.push_back({{"source", each.source}, {"active", each.active}});
  }
  return result;
}

std::string literals_text(const std::vector<rules::Literal>& literals, const Sources& sources) {
  std::string text;
  for (std::size_t i = 0; i < std::min(literals.size(), kMaxNamed); ++i) {
    if (i != 0) text += i + 1 == literals.size() ? " and " : ", ";
    text += literals[i].source + " is " + activity_text(sources, literals[i].source);
  }
  if (literals.size() > kMaxNamed) {
    text += ", and " + std::to_string(literals.size() - kMaxNamed) + " more as they are";
  }
  return text;
}

using OwnActivity = rules::Cause::OwnActivity;

std::string inhibition_text(const rules::Cause& cause, const Sources& sources) {
  const bool will_be = cause.own_activity == OwnActivity::kWillMatter;
  std::string text =
      (will_be ? "would be inhibited by " : "inhibited by ") + describe(*cause.inhibitor);
  if (cause.speaker) text += " (its behaviour \"" + cause.speaker->name + "\")";
  if (cause.of && cause.of->is_meta) text += " through " + describe(*cause.of);
  text += place_text(cause.where) + ": ";
  std::vector<rules::Literal> because = cause.because;
  std::vector<std::string> also = cause.also;
  const bool is_own_too = because.empty() && !also.empty();
  if (is_own_too) {
    because.push_back({also.front(), true});
    also.erase(also.begin());
  }
  text += because.empty()
              ? std::string(will_be ? "once it is active, it is itself" : "it is itself") +
                    " a source of that one"
              : literals_text(because, sources);
  if (!also.empty()) {
    text += "; so " + std::string(also.size() == 1 ? "is " : "are ");
    for (std::size_t i = 0; i < std::min(also.size(), kMaxNamed); ++i) {
      text += (i == 0 ? "" : ", ") + also[i];
    }
    if (also.size() > kMaxNamed) text += ", …";
  }
  if (is_own_too) text += "; it is itself a source of that one, too";
  if (cause.across_ports) text += "; it has no connection here, so each of its sources inhibits";
  return text;
}

std::string timeout_text(const SourceState& source) {
  const std::string& place = source.timeout_place;
  return "T " + rules::to_string(source.timeout) +
         (place.empty()        ? ""
          : place == "default" ? " by default"
                               : " by " + place);
}

// Of one whose last arrival is not known.
std::string past_timeout_text(const SourceState& source) {
  return "T was " + rules::to_string(*source.timeout_before) +
         " before the model changed it, so the time of its arrival is not known; now " +
         timeout_text(source) + ")";
}

// Of those whose last arrival is not known.
std::string ending_text(const SourceState& source, shm::Nanoseconds now) {
  return "active (for " + span_text(source.word - now) + " more; " + past_timeout_text(source);
}

std::string ended_text(const SourceState& source, shm::Nanoseconds now) {
  return "inactive (for " + span_text(now - source.word) + "; " + past_timeout_text(source);
}

// At its beginning, whatever has become of it since.
bool becomes_active(const SourceState& state, shm::Nanoseconds now) {
  return state.began == now || shm::is_active(state.word, now);
}

}  // namespace

std::string place_text(const rules::Location& where) {
  return where.file.empty()
             ? ""
             : " (" + shm::printable(where.file) + ":" + std::to_string(where.line) + ")";
}

std::string activity_text(const Sources& sources, const std::string& name) {
  const SourceState source = sources.state(name);
  const shm::Nanoseconds now = sources.now();
  if (!source.is_visible) return "not visible yet (the daemon has no page of its activity)";
  if (source.word == shm::kNeverActive) return "inactive (it has never arrived)";
  if (shm::is_deactivation(source.word)) {
    const shm::Nanoseconds ago = now - (source.word & ~shm::kDeactivatedFlag);
    return "inactive (deactivated " + (ago <= 0 ? "just now" : span_text(ago) + " ago") + ")";
  }
  const auto arrival = source.last_arrival();
  const bool is_active = sources.is_active(name);
  if (!arrival) return is_active ? ending_text(source, now) : ended_text(source, now);
  const shm::Nanoseconds span = now - *arrival;
  const std::string since =
      (span <= 0 ? "just now" : span_text(span) + " ago") + ", " + timeout_text(source) + ")";
  return is_active ? "active (arrived " + since : "inactive (last arrival " + since;
}

json activity_json(const Sources& sources, const std::string& name) {
  const SourceState source = sources.state(name);
  json result = {
      {"source", name},
      {"active", sources.is_active(name)},
      {"timeout_ns", source.timeout == shm::kForever ? json("forever") : json(source.timeout)},
      {"timeout_from", source.timeout_place.empty() ? json(nullptr) : json(source.timeout_place)},
      {"last_arrival_ns", nullptr},
      {"deactivated_ns", nullptr},
      {"ends_ns", nullptr}};
  if (!source.is_visible) result["active"] = nullptr;
  if (source.word == shm::kNeverActive) return result;
  if (shm::is_deactivation(source.word)) {
    result["deactivated_ns"] = source.word & ~shm::kDeactivatedFlag;
    return result;
  }
  if (const auto arrival = source.last_arrival()) result["last_arrival_ns"] = *arrival;
  if (shm::is_finite(source.word)) result["ends_ns"] = source.word;
  return result;
}

std::string cause_text(const rules::Cause& cause, const Sources& sources) {
  if (cause.kind == rules::Cause::Kind::kInhibited) return inhibition_text(cause, sources);
  const bool reads_itself = cause.own_activity != OwnActivity::kNoMatter;
  const std::string because = !cause.because.empty() ? literals_text(cause.because, sources)
                              : reads_itself ? "no activity of other sources can make it true"
                                             : "no activity of the sources can make it true";
  const bool will_be = cause.own_activity == OwnActivity::kWillMatter;
  const std::string itself = will_be        ? " once it is active itself"
                             : reads_itself ? " while it is active itself"
                                            : "";
  if (cause.kind == rules::Cause::Kind::kUnwritten) {
    return (will_be ? "its rule would not hold" : "its rule does not hold") + itself + ": " +
           because;
  }
  const std::string whose = cause.of ? "the condition of " + describe(*cause.of) : "its condition";
  return whose + ", " + cause.condition + (will_be ? ", would be false" : ", is false") + itself +
         place_text(cause.where) + ": " + because;
}

json cause_json(const rules::Cause& cause) {
  static constexpr const char* kKinds[] = {"inhibited", "condition-false", "rule-false"};
  json result = {{"kind", kKinds[static_cast<int>(cause.kind)]},
                 {"where", place_json(cause.where)},
                 {"because", literals_json(cause.because)},
                 {"by_own_activity", cause.own_activity != OwnActivity::kNoMatter}};
  if (cause.of) result["of"] = element_json(cause.of);
  if (cause.inhibitor) {
    result["inhibitor"] = element_json(cause.inhibitor);
    result["speaker"] = element_json(cause.speaker);
    result["also"] = cause.also;
    result["across_ports"] = cause.across_ports;
  }
  if (!cause.condition.empty()) result["condition"] = cause.condition;
  return result;
}

std::string headline(const rules::Cause& cause) {
  if (cause.kind == rules::Cause::Kind::kInhibited) {
    return "inhibited by " + describe(*cause.inhibitor) + place_text(cause.where);
  }
  if (cause.kind == rules::Cause::Kind::kUnwritten) return "kept out by their rules";
  const std::string whose = cause.of ? "the condition of " + describe(*cause.of) : "a condition";
  return "kept out by " + whose + ", " + cause.condition + place_text(cause.where);
}

std::string first_cause(const rules::ConnectionExplanation& connection, const Sources& sources) {
  if (!connection.has_rule) return "no rule selects it, so it never delivers here";
  if (!connection.is_active) return "it is " + activity_text(sources, connection.source);
  if (connection.earlier) {
    return *connection.earlier + " comes before it in the model, and conflict=\"first\" is set";
  }
  for (const auto& part : connection.parts) {
    if (!part.causes.empty()) return cause_text(part.causes.front(), sources);
  }
  return "nothing";
}

std::vector<std::string> causes_in_short(const rules::ConnectionExplanation& connection) {
  std::vector<std::string> causes;
  if (connection.wins) return causes;
  if (!connection.has_rule) causes.emplace_back("no rule lets it win");
  if (connection.earlier) causes.push_back("an earlier rule holds: that of " + *connection.earlier);
  const auto& parts = connection.parts;
  const bool may_hold = std::any_of(parts.begin(), parts.end(),
                                    [](const rules::Part& part) { return part.causes.empty(); });
  // What keeps one of its behaviours out is no cause where another would select it.
  if (may_hold) return causes;
  for (const rules::Part& part : parts) {
    const bool is_alone = parts.size() == 1 || !part.behaviour;
    const std::string whose = is_alone ? "" : "as " + describe(*part.behaviour) + " has it: ";
    for (const rules::Cause& cause : part.causes) causes.push_back(whose + headline(cause));
  }
  return causes;
}

std::string loss_text(const rules::ConnectionExplanation& loser, const Sources& sources) {
  const std::string cause = first_cause(loser, sources);
  return cause.starts_with("inhibited") ? cause : "out: " + cause;
}

void write_causes(std::ostream& out, const rules::ConnectionExplanation& connection,
                  const Sources& sources, std::size_t max_lines) {
  if (!connection.has_rule) {
    out << "  no rule selects it, so it never delivers here" << place_text(connection.where)
        << (connection.is_read ? "; its activity counts for the rules that read it"
                               : "; nor does any rule read it")
        << '\n';
    return;
  }
  if (connection.earlier) {
    out << "  " << *connection.earlier
        << (connection.is_active ? " comes before it in the model, and if two rules hold"
                                 : " would win even if it were active: it comes first in the "
                                   "model, and if two rules hold")
        << " the first wins (conflict=\"first\")\n";
  }
  for (const auto& part : connection.parts) {
    const std::string who = part.behaviour ? describe(*part.behaviour) : std::string("its rule");
    if (part.causes.empty()) {
      if (connection.is_active || connection.earlier) continue;
      out << "  " << who << place_text(part.where) << " would select it, if it were active\n";
      continue;
    }
    const std::string indent = connection.parts.size() > 1 ? "    " : "  ";
    if (connection.parts.size() > 1)
      out << "  as " << who << place_text(part.where) << " has it:\n";
    const std::size_t told = std::min(part.causes.size(), max_lines);
    for (std::size_t i = 0; i < told; ++i) {
      out << indent << cause_text(part.causes[i], sources) << '\n';
    }
    if (told < part.causes.size()) {
      out << indent << "and for " << part.causes.size() - told << " more reasons like these\n";
    }
  }
}

json connection_json(const rules::ConnectionExplanation& connection, const Sources& sources) {
  json result = activity_json(sources, connection.source);
  result["winner"] = connection.wins;
  result["has_rule"] = connection.has_rule;
  if (!connection.has_rule) {
    result["where"] = place_json(connection.where);
    result["is_read"] = connection.is_read;
  }
  result["rule_holds"] = connection.holds;
  result["earlier"] = connection.earlier ? json(*connection.earlier) : json(nullptr);
  const auto reason = connection.reason();
  result["reason"] = reason ? literals_json(*reason) : json(nullptr);
  result["behaviours"] = json::array();
  for (const auto& part : connection.parts) {
    json causes = json::array();
    for (const auto& cause : part.causes) causes.push_back(cause_json(cause));
    result["behaviours"].push_back(
        {{"behaviour", part.behaviour ? json(part.behaviour->name) : json(nullptr)},
         {"where", place_json(part.where)},
         {"causes", std::move(causes)}});
  }
  return result;
}

std::string event_text(const std::string& source, const SourceState& state, shm::Nanoseconds now) {
  if (becomes_active(state, now)) return source + " became active";
  if (shm::is_deactivation(state.word)) return source + " was deactivated";
  const auto arrival = state.last_arrival();
  if (!arrival) return source + " went inactive";
  return source + " went inactive, " + span_text(state.word - *arrival) + " after its last arrival";
}

json event_json(const std::string& source, const SourceState& state, shm::Nanoseconds now) {
  const char* what = becomes_active(state, now)         ? "active"
                     : shm::is_deactivation(state.word) ? "deactivated"
                                                        : "expired";
  return {{"source", source}, {"became", what}, {"at_ns", event_time(state, now)}};
}

json obstacles_json(const std::vector<watch::Obstacle>& obstacles) {
  json result = json::array();
  for (const auto& each : obstacles) result.push_back({{"code", each.code}, {"text", each.text}});
  return result;
}

std::vector<std::string> sources_that_matter(const rules::ConnectionExplanation& connection) {
  std::set<std::string> names;
  for (const auto& part : connection.parts) {
    for (const auto& cause : part.causes) {
      for (const auto& literal : cause.because) names.insert(literal.source);
    }
  }
  for (const auto& literal : connection.earlier_because) names.insert(literal.source);
  names.erase(connection.source);
  return {names.begin(), names.end()};
}

void write_obstacles(std::ostream& out, const std::vector<watch::Obstacle>& obstacles,
                     const std::string& of) {
  for (const auto& each : obstacles) {
    // Some texts begin with the name already.
    const bool is_named = !of.empty() && each.text.starts_with(of + ' ');
    out << (each.is_wrong ? "  ! " : "  ") << (of.empty() || is_named ? "" : of + ": ") << each.text
        << '\n';
  }
}

}  // namespace arbiter::cli
