#include "rules/prove/conflict_advice.hpp"

#include <algorithm>

#include "rules/text/names.hpp"

namespace arbiter::rules {

std::string ConflictAdvice::inhibition(const std::vector<std::size_t>& one,
                                       const std::vector<std::size_t>& other) {
  const char* const plain = "let one inhibit the other";
  if (one.empty() || other.empty()) return {};
  if (one.size() > 1 || other.size() > 1) return plain;
  if (one == other) {
    return "give each a behaviour of its own in place of " +
           quote(rules_.behaviours[one.front()].name) + " and let one inhibit the other";
  }
  const auto way = way_to(rules_.behaviours[one.front()].name);
  const auto other_way = way_to(rules_.behaviours[other.front()].name);
  const auto parting = std::mismatch(way.begin(), way.end(), other_way.begin(), other_way.end());
  if (parting.first == way.end() || parting.second == other_way.end()) return plain;
  if (parting.first + 1 == way.end() && parting.second + 1 == other_way.end()) return plain;
  return "let " + quote(*parting.first) + " inhibit " + quote(*parting.second) +
         " or the other way round";
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
