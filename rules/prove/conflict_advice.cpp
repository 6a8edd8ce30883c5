#include "rules/prove/conflict_advice.hpp"

#include <algorithm>

#include "rules/text/names.hpp"

namespace arbiter::rules {

std::string ConflictAdvice::inhibition(const std::vector<std::size_t>& one,
                                       const std::vector<std::size_t>& other) {
  if (one.empty() || other.empty()) return {};
  if (one.size() > 1 || other.size() > 1) {
    const std::string advice = inhibition_of_all(one, other);
    return advice.empty() ? inhibition_of_all(other, one) : advice;
  }
  if (one == other) {
    return "give each a behaviour of its own in place of " +
           quote(rules_.behaviours[one.front()].name) + " and let one inhibit the other";
  }
  const char* const plain = "let one inhibit the other";
  const auto siblings = siblings_above(one.front(), other.front());
  if (!siblings) return plain;
  const auto& [mine, theirs] = *siblings;
  const bool are_they = mine == rules_.behaviours[one.front()].name &&
                        theirs == rules_.behaviours[other.front()].name;
  if (are_they) return plain;
  return "let " + quote(mine) + " inhibit " + quote(theirs) + " or the other way round";
}

// One inhibitor that has the one's source is enough, if none of the behaviours that configure the
// other is left out, and the one keeps all of its own.
std::string ConflictAdvice::inhibition_of_all(const std::vector<std::size_t>& inhibitors,
                                              const std::vector<std::size_t>& inhibited) {
  for (const std::size_t inhibitor : inhibitors) {
    std::string_view name;
    std::vector<std::string> names;
    for (const std::size_t each : inhibited) {
      const auto siblings = siblings_above(inhibitor, each);
      if (!siblings || (!name.empty() && siblings->first != name) ||
          is_any_in(siblings->second, inhibitors)) {
        names.clear();
        break;
      }
      name = siblings->first;
      std::string theirs = quote(siblings->second);
      if (std::find(names.begin(), names.end(), theirs) == names.end()) {
        names.push_back(std::move(theirs));
      }
    }
    constexpr std::size_t kMost = 4;  // more than these is no advice
    if (names.empty() || names.size() > kMost) continue;
    return "let " + quote(name) + " inhibit " + enumerate(names);
  }
  return {};
}

bool ConflictAdvice::is_any_in(std::string_view parent, const std::vector<std::size_t>& of) {
  return std::any_of(of.begin(), of.end(), [&](std::size_t behaviour) {
    const auto way = way_to(rules_.behaviours[behaviour].name);
    return std::find(way.begin(), way.end(), parent) != way.end();
  });
}

std::optional<ConflictAdvice::Siblings> ConflictAdvice::siblings_above(std::size_t one,
                                                                       std::size_t other) {
  const auto way = way_to(rules_.behaviours[one].name);
  const auto other_way = way_to(rules_.behaviours[other].name);
  const auto parting = std::mismatch(way.begin(), way.end(), other_way.begin(), other_way.end());
  if (parting.first == way.end() || parting.second == other_way.end()) return {};
  return Siblings{*parting.first, *parting.second};
}

std::vector<std::string_view> ConflictAdvice::way_to(std::string_view behaviour) {
  if (parents_.empty()) {
    for (const MetaBehaviour& meta : rules_.meta_behaviours) {
      for (const std::string& child : meta.children) parents_.emplace(child, meta.name);
    }
  }
  std::vector<std::string_view> way{behaviour};
  // What is wrong with the hierarchy may have made a circle.
  while (way.size() <= rules_.meta_behaviours.size()) {
    const auto parent = parents_.find(way.back());
    if (parent == parents_.end()) break;
    way.push_back(parent->second);
  }
  std::reverse(way.begin(), way.end());
  return way;
}

}  // namespace arbiter::rules
