#include "bench/harness/report.hpp"

#include <algorithm>

namespace arbiter::bench {
namespace {

template <class Items, class Name>
auto find_in(const Items& items, Name name) -> decltype(&items[0]) {
  const auto found = std::find_if(items.begin(), items.end(), name);
  return found == items.end() ? nullptr : &*found;
}

const char* text_of(Role role) {
  switch (role) {
    case Role::kOurs:
      return "ours";
    case Role::kPeer:
      return "peer";
    case Role::kFloor:
      return "floor";
  }
  return "";
}

nlohmann::json json_of(const Result& result) {
  nlohmann::json json{{"system", result.system}, {"role", text_of(result.role)}};
  if (!result.note.empty()) json["note"] = result.note;
  if (result.value) json["value"] = *result.value;
  const Histogram& ns = result.ns;
  if (ns.count() == 0) return json;
  json["count"] = ns.count();
  json["mean"] = ns.mean();
  json["min"] = ns.min();
  json["p50"] = ns.quantile(0.5);
  for (const Tail& tail : kTails) {
    if (tail.is_known(ns)) json[tail.name] = ns.quantile(tail.share);
  }
  json["max"] = ns.max();
  json["curve"] = ns.curve();
  return json;
}

// What each result is of each peer's and floor's, by p50 or by value.
nlohmann::json ratios_of(const Case& of) {
  const auto figure = [](const Result& result) {
    return result.value ? *result.value : result.ns.count() == 0 ? 0 : result.ns.quantile(0.5);
  };
  nlohmann::json ratios = nlohmann::json::object();
  for (const Result& ours : of.results) {
    if (ours.role != Role::kOurs || figure(ours) <= 0) continue;
    for (const Result& theirs : of.results) {
      if (theirs.role == Role::kOurs || figure(theirs) <= 0) continue;
      ratios[ours.system][theirs.system] = figure(ours) / figure(theirs);
    }
  }
  return ratios;
}

}  // namespace

const Result* Case::find(const std::string& wanted) const {
  return find_in(results, [&](const Result& each) { return each.system == wanted; });
}
const Case* Measure::find(const std::string& wanted) const {
  return find_in(cases, [&](const Case& each) { return each.name == wanted; });
}
const Measure* Report::find(const std::string& wanted) const {
  return find_in(measures, [&](const Measure& each) { return each.name == wanted; });
}

nlohmann::json Report::json() const {
  nlohmann::json json{{"quick", quick}, {"machine", machine}, {"warnings", warnings}};
  json["measures"] = nlohmann::json::array();
  for (const Measure& measure : measures) {
    nlohmann::json cases = nlohmann::json::array();
    for (const Case& each : measure.cases) {
      nlohmann::json results = nlohmann::json::array();
      for (const Result& result : each.results) results.push_back(json_of(result));
      nlohmann::json one{
          {"name", each.name}, {"results", results}, {"p50_ratios", ratios_of(each)}};
      if (each.x) one["x"] = *each.x;
      if (!each.unit.empty()) one["unit"] = each.unit;
      cases.push_back(std::move(one));
    }
    json["measures"].push_back({{"name", measure.name},
                                {"title", measure.title},
                                {"explanation", measure.explanation},
                                {"unit", measure.unit},
                                {"x_label", measure.x_label},
                                {"cases", std::move(cases)}});
  }
  json["targets"] = nlohmann::json::array();
  for (const Verdict& target : targets) {
    nlohmann::json one{{"name", target.name},
                       {"limit", target.limit},
                       {"unit", target.unit},
                       {"met", target.is_met()}};
    if (!target.group.empty()) one["group"] = target.group;
    if (target.measured) one["measured"] = *target.measured;
    json["targets"].push_back(std::move(one));
  }
  return json;
}

}  // namespace arbiter::bench
