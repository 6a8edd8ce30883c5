// A compiled model under the code that decides live, with activities set by hand.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "rules/prove/compile.hpp"
#include "rules/prove/flatten.hpp"
#include "shm/port_picture.hpp"

namespace arbiter::test {

class LiveTable {
 public:
  // Ids leave gaps, as they do in a daemon that has seen other models before.
  explicit LiveTable(const rules::CompiledModel& model)
      : source_ids_(number(model.sources)),
        port_ids_(number(port_names(model))),
        words_(load(model)),
        activity_(3 * model.sources.size() + 3),
        pages_(std::make_unique<shm::ActivityPages>()) {
    for (std::size_t id = 0; id < activity_.size(); ++id) {
      pages_->attach(static_cast<shm::SourceId>(id), &activity_[id]);
    }
  }

  [[nodiscard]] shm::TableView view() const {
    return {words_.data(), static_cast<shm::Word>(words_.size())};
  }
  [[nodiscard]] shm::SourceId source_id(const std::string& name) const {
    return source_ids_.at(name);
  }
  [[nodiscard]] shm::PortId port_id(const std::string& name) const { return port_ids_.at(name); }

  // Nothing for shm::kNone, and for ids that are nobody's.
  [[nodiscard]] std::optional<std::string> name_of(shm::SourceId id) const {
    for (const auto& [name, each] : source_ids_) {
      if (each == id) return name;
    }
    return std::nullopt;
  }

  void activate_only(const std::set<std::string>& active) {
    for (const auto& [name, id] : source_ids_) {
      activity_[id].word = active.contains(name) ? shm::arrival(clock_.now, shm::kForever)
                                                 : shm::deactivation(clock_.now);
    }
  }

  // Whether an arrival would be delivered.
  [[nodiscard]] bool delivers(const std::string& source, const std::string& port) {
    const shm::TableView table = view();
    const auto connection = table.find(source_id(source), port_id(port));
    if (connection == shm::kNone) return false;
    return shm::Decider(table, *pages_, clock_).decide(table.rule(connection)) ==
           shm::Verdict::kWins;
  }

  [[nodiscard]] shm::PortPicture picture(const std::string& port) {
    shm::PortPicture picture;
    picture.bind(view(), port_id(port), *pages_);
    if (!picture.take(clock_)) throw std::logic_error("nothing changes, and it is not settled");
    return picture;
  }

  [[nodiscard]] std::vector<std::string> winners(const std::string& port) {
    const shm::TableView table = view();
    shm::Decider decider(table, *pages_, clock_);
    std::vector<std::string> result;
    const auto range = table.connections_to(port_id(port));
    for (auto c = range.first; c < range.first + range.count; ++c) {
      const shm::Rule rule = table.rule(c);
      if (decider.decide_with_own(rule) != shm::Verdict::kWins) continue;
      result.push_back(name_of(rule.source).value());
    }
    return result;
  }

  [[nodiscard]] std::optional<std::string> winner(const std::string& port) {
    const auto all = winners(port);
    return all.empty() ? std::nullopt : std::optional(all.front());
  }

 private:
  struct Clock {
    shm::Nanoseconds now = 1000;
    [[nodiscard]] shm::Nanoseconds reading() const { return now; }
    [[nodiscard]] bool is_fresh() const { return true; }
    void read() {}
  };

  static std::vector<std::string> port_names(const rules::CompiledModel& model) {
    std::vector<std::string> names;
    for (const auto& port : model.ports) names.push_back(port.port);
    return names;
  }
  static std::map<std::string, std::uint32_t> number(const std::vector<std::string>& names) {
    std::map<std::string, std::uint32_t> ids;
    for (const auto& name : names)
      ids.emplace(name, 3 * static_cast<std::uint32_t>(ids.size()) + 2);
    return ids;
  }
  std::vector<shm::Atomic<shm::Word>> load(const rules::CompiledModel& model) const {
    const auto words =
        rules::flatten(model, {[&](const std::string& name) { return source_ids_.at(name); },
                               [&](const std::string& name) { return port_ids_.at(name); }});
    std::vector<shm::Atomic<shm::Word>> table(words.size());
    for (std::size_t i = 0; i < words.size(); ++i) table[i] = words[i];
    return table;
  }

  std::map<std::string, std::uint32_t> source_ids_, port_ids_;
  std::vector<shm::Atomic<shm::Word>> words_;
  std::vector<shm::Activity> activity_;
  std::unique_ptr<shm::ActivityPages> pages_;
  Clock clock_;
};

// All subsets of a few names.
inline std::vector<std::set<std::string>> subsets(const std::vector<std::string>& names) {
  std::vector<std::set<std::string>> result;
  for (std::size_t mask = 0; mask < std::size_t{1} << names.size(); ++mask) {
    std::set<std::string> subset;
    for (std::size_t i = 0; i < names.size(); ++i) {
      if ((mask >> i & 1) != 0) subset.insert(names[i]);
    }
    result.push_back(std::move(subset));
  }
  return result;
}

}  // namespace arbiter::test
