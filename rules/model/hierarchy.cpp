#include "rules/model/hierarchy.hpp"

#include <algorithm>
#include <cstdint>
#include <string_view>
#include <unordered_set>

#include "rules/text/names.hpp"

namespace arbiter::rules {

Hierarchy::Hierarchy(const Model& model, Diagnostics& diagnostics)
    : model_(model),
      diagnostics_(diagnostics),
      parents_(model.behaviours.size(), kNobody),
      adoptions_(model.behaviours.size(), nullptr),
      misplaced_(model.behaviours.size(), false),
      children_(model.behaviours.size()),
      inhibitors_(model.behaviours.size()),
      doubts_(model.behaviours.size()) {
  index_names();
  adopt_children();
  cut_cycles();
  for (std::size_t b = 0; b < parents_.size(); ++b) {
    if (parents_[b] != kNobody) children_[parents_[b]].push_back(b);
  }
  check_depth();
  link_inhibitions();
  check_emptiness();
}

void Hierarchy::index_names() {
  lacks_parents_ = model_.has_unknown_gaps || !model_.refused_names.empty();
  for (std::size_t b = 0; b < model_.behaviours.size(); ++b) {
    const Behaviour& behaviour = model_.behaviours[b];
    if (behaviour.is_meta && behaviour.is_incomplete) lacks_parents_ = true;
    const auto [first, is_new] = by_name_.try_emplace(behaviour.name, b);
    if (is_new) continue;
    misplaced_[b] = true;
    doubt_place(b);
    doubt_place(first->second);
    diagnostics_.error("duplicate-name", behaviour.where,
                       "the name " + quote(behaviour.name) + " is taken already, at " +
                           describe(model_.behaviours[first->second].where) +
                           "; rename or remove one",
                       {.behaviour = behaviour.name});
  }
}

// What is above it is in doubt, and what those that contain it have.
void Hierarchy::doubt_place(std::size_t behaviour) {
  doubts_[behaviour].of_rule = doubts_[behaviour].of_parts = true;
}

std::size_t Hierarchy::look_up(const Mention& mention) const {
  const auto found = by_name_.find(mention.name);
  if (found != by_name_.end()) return found->second;
  if (model_.has_unknown_gaps || model_.refused_names.count(mention.name) != 0) return kNobody;
  std::vector<std::string_view> known;
  if (diagnostics_.items().size() < kMaxSuggestions) {
    for (const Behaviour& behaviour : model_.behaviours) known.push_back(behaviour.name);
  }
  const std::string list = known.empty() ? "" : as_list(mention.name);
  std::string advice = known.empty() ? "" : advice_on_source(mention.name);
  if (!list.empty()) {
    advice = "; names are separated by commas: write " + quote(list);
  } else if (mention.name.find(';') != std::string::npos) {
    advice = "; names are separated by commas";
  } else if (mention.name.find('*') != std::string::npos || mention.name == "all") {
    advice = "; each is named by itself, or all that are in one meta-behaviour by its name";
  } else if (advice.empty()) {
    const std::string longer = known.empty() ? "" : longer_name(mention.name);
    advice =
        advise(mention.name, known,
               longer.empty() ? "define it, correct the name, or give the file that has it as well"
                              : "did you mean " + quote(longer) + "?");
  }
  diagnostics_.error("unknown-name", mention.where,
                     "no behaviour has the name " + quote(mention.name) + advice,
                     {.behaviour = mention.name});
  return kNobody;
}

// The only behaviour whose name has this one among its words; empty: there is none, or several.
std::string Hierarchy::longer_name(const std::string& name) const {
  std::string_view found;
  const std::string words = ' ' + lower_case(name) + ' ';
  for (const Behaviour& each : model_.behaviours) {
    if ((' ' + lower_case(each.name) + ' ').find(words) == std::string::npos) continue;
    if (!found.empty()) return {};
    found = each.name;
  }
  return std::string(found);
}

// Where a source stands in the place of a behaviour's name; empty: it is none.
std::string Hierarchy::advice_on_source(const std::string& name) const {
  if (model_.source_uses.find(name) == nullptr) return {};
  std::vector<std::string> behaviours;
  for (const Behaviour& each : model_.behaviours) {
    const bool connects = std::any_of(each.configs.begin(), each.configs.end(),
                                      [&](const Config& config) { return config.source == name; });
    if (connects) behaviours.push_back(quote(each.name));
  }
  if (behaviours.empty()) return "; it is a source, which no behaviour connects: name a behaviour";
  return "; it is a source: name the behaviour that connects it, " + enumerate(behaviours);
}

// "Rest, Look Around" for "Rest; Look Around", or without a comma; empty: these are not all names.
std::string Hierarchy::as_list(std::string_view text) const {
  constexpr std::string_view kSeparators = " ;\t\n";
  constexpr std::size_t kMost = 1024;  // bytes: all beginnings of each rest are tried
  if (text.size() > kMost) return {};
  std::string list;
  while (!text.empty()) {
    std::size_t length = text.size();  // of the longest name that it begins with
    while (length > 0 && by_name_.count(std::string(trim(text.substr(0, length)))) == 0) {
      length = text.substr(0, length).find_last_of(kSeparators);
      if (length == std::string_view::npos) return {};
    }
    if (length == 0) return {};
    list += (list.empty() ? "" : ", ") + std::string(trim(text.substr(0, length)));
    const std::size_t next = text.find_first_not_of(kSeparators, length);
    text = next == std::string_view::npos ? std::string_view() : text.substr(next);
  }
  return list;
}

void Hierarchy::adopt_children() {
  for (std::size_t meta = 0; meta < model_.behaviours.size(); ++meta) {
    const auto& mentions = model_.behaviours[meta].children;
    if (misplaced_[meta]) {  // the second one of its name
      for (const Mention& mention : mentions) {
        const auto child = by_name_.find(mention.name);
        if (child != by_name_.end()) doubt_place(child->second);
      }
      continue;
    }
    for (const Mention& mention : mentions) {
      const std::size_t child = look_up(mention);
      if (child == kNobody) {
        doubts_[meta].of_parts = true;
        continue;
      }
      if (parents_[child] == kNobody) {
        parents_[child] = meta;
        adoptions_[child] = &mention;
        continue;
      }
      misplaced_[child] = true;
      doubt_place(child);
      doubts_[meta].of_parts = true;
      const bool is_same = parents_[child] == meta;
      diagnostics_.error(
          "two-parents", mention.where,
          quote(mention.name) + " is in " +
              (is_same ? "this meta-behaviour" : quote(model_.behaviours[parents_[child]].name)) +
              " already, at " + describe(adoptions_[child]->where) +
              (is_same ? "; remove one of the two"
                       : "; a behaviour is in one meta-behaviour at most, remove it from one"),
          {.behaviour = mention.name});
    }
  }
}

// Each behaviour has one parent at most, so that a walk upwards ends at the top or in a cycle.
void Hierarchy::cut_cycles() {
  constexpr std::size_t kUnseen = 0;
  std::vector<std::size_t> seen_by(parents_.size(), kUnseen);
  for (std::size_t start = 0; start < parents_.size(); ++start) {
    std::size_t at = start;
    while (at != kNobody && seen_by[at] == kUnseen) {
      seen_by[at] = start + 1;
      at = parents_[at];
    }
    if (at != kNobody && seen_by[at] == start + 1) cut_cycle(at);
  }
}

void Hierarchy::cut_cycle(std::size_t start) {
  std::vector<std::size_t> members;
  for (std::size_t at = start; members.empty() || at != start; at = parents_[at]) {
    members.push_back(at);
  }
  // Told from the member that comes first in the document, downwards.
  std::rotate(members.begin(), std::min_element(members.begin(), members.end()), members.end());
  constexpr std::size_t kMaxNamed = 8;
  std::string path = quote(model_.behaviours[members.front()].name);
  for (std::size_t i = members.size(); i-- > 0;) {
    if (members.size() - i > kMaxNamed && i != 0) {
      path += " contains …";
      i = 1;
      continue;
    }
    path += " contains " + quote(model_.behaviours[members[i]].name);
  }
  const std::size_t first_child = members.back();
  diagnostics_.error("cycle", adoptions_[first_child]->where,
                     "no meta-behaviour can contain itself: " + path + "; remove one of these",
                     {.behaviour = model_.behaviours[members.front()].name});
  for (const std::size_t member : members) {
    parents_[member] = kNobody;
    misplaced_[member] = true;
    doubt_place(member);
  }
}

void Hierarchy::check_depth() {
  std::vector<std::size_t> pending;
  std::vector<int> depths(parents_.size(), 0);
  for (std::size_t b = 0; b < parents_.size(); ++b) {
    if (parents_[b] == kNobody) pending.push_back(b);
  }
  while (!pending.empty()) {
    const std::size_t at = pending.back();
    pending.pop_back();
    for (const std::size_t child : children_[at]) {
      depths[child] = depths[at] + 1;
      if (depths[child] <= kMaxMetaDepth) {
        pending.push_back(child);
        continue;
      }
      diagnostics_.error("limit-exceeded", adoptions_[child]->where,
                         quote(model_.behaviours[child].name) +
                             " is inside more meta-behaviours than the limit of " +
                             std::to_string(kMaxMetaDepth) + "; nest them less deeply",
                         {.behaviour = model_.behaviours[child].name});
      parents_[child] = kNobody;  // and the rest below it is not looked at
      misplaced_[child] = true;
      doubt_place(child);
    }
  }
}

void Hierarchy::link_inhibitions() {
  for (std::size_t b = 0; b < model_.behaviours.size(); ++b) {
    const auto& mentions = model_.behaviours[b].inhibitions;
    std::unordered_set<std::size_t> named;
    for (std::size_t m = 0; m < mentions.size(); ++m) {
      const std::size_t inhibited = look_up(mentions[m]);
      if (inhibited == kNobody) doubts_[b].of_inhibitions = true;
      if (inhibited == kNobody || !named.insert(inhibited).second) continue;
      if (may_inhibit(b, inhibited, mentions[m])) {
        inhibitors_[inhibited].push_back({b, m});
      } else {
        doubts_[inhibited].of_rule = true;
      }
    }
  }
}

std::string Hierarchy::describe_place(std::size_t behaviour) const {
  if (parents_[behaviour] == kNobody) return "is in no meta-behaviour";
  return "is in " + quote(model_.behaviours[parents_[behaviour]].name);
}

bool Hierarchy::may_inhibit(std::size_t inhibitor, std::size_t inhibited, const Mention& mention) {
  const std::string& name = model_.behaviours[inhibitor].name;
  if (inhibitor == inhibited || name == mention.name) {
    diagnostics_.error("self-inhibition", mention.where,
                       quote(name) + " inhibits itself; remove this name", {.behaviour = name});
    doubts_[inhibitor].of_inhibitions = true;  // another one may be meant
    return false;
  }
  if (misplaced_[inhibitor] || misplaced_[inhibited]) return false;
  if (parents_[inhibitor] == parents_[inhibited]) return true;
  const bool is_orphan = parents_[inhibitor] == kNobody || parents_[inhibited] == kNobody;
  if (is_orphan && lacks_parents_) return false;
  const std::size_t parent = std::min(parents_[inhibitor], parents_[inhibited]);  // kNobody is last
  if (is_orphan && doubts_[parent].of_parts) return false;  // it may be the child that is misspelt
  diagnostics_.error("not-a-sibling", mention.where,
                     quote(name) + " cannot inhibit " + quote(mention.name) +
                         ", for only behaviours in the same meta-behaviour can: the one " +
                         describe_place(inhibitor) + ", the other " + describe_place(inhibited) +
                         "; let siblings inhibit each other, or move one of the two",
                     {.behaviour = name});
  return false;
}

void Hierarchy::check_emptiness() const {
  for (const Behaviour& behaviour : model_.behaviours) {
    if (behaviour.is_incomplete) continue;
    if (behaviour.is_meta && behaviour.children.empty()) {
      diagnostics_.warning("no-children", behaviour.where,
                           "the meta-behaviour " + quote(behaviour.name) +
                               " contains nothing; name its behaviours with <behavior>",
                           {.behaviour = behaviour.name});
    }
    if (!behaviour.is_meta && behaviour.configs.empty()) {
      diagnostics_.warning(
          "no-config", behaviour.where,
          "the behaviour " + quote(behaviour.name) + " selects no connection" +
              (behaviour.inhibitions.empty() ? "" : ", so that it inhibits nothing") +
              "; write a <config> for each one",
          {.behaviour = behaviour.name});
    }
  }
}

}  // namespace arbiter::rules
