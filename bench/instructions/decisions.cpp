// The decision alone, as publish() and take() make it: over a table that the compiler of rules
// made.
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/instructions/counting.hpp"
#include "rules/prove/compile.hpp"
#include "rules/prove/flatten.hpp"
#include "shm/clock.hpp"
#include "shm/decision.hpp"

namespace arbiter::bench {
namespace {

constexpr shm::Nanoseconds kNow = 1'000'000'000;
constexpr shm::Nanoseconds kHour = 3'600'000'000'000;

std::string source(std::size_t i) { return "/s" + std::to_string(1000 + i); }

// The connection of "/from", the last at "/to"; the rules read `reads`. Every second source is
// active.
class Table {
 public:
  Table(std::vector<rules::CompiledRule> rules, const std::vector<std::string>& reads)
      : activities_(reads.size() + 1) {
    rules::CompiledModel model;
    model.timeout = kHour;
    model.sources = reads;
    model.sources.push_back("/from");
    rules.back().source = "/from";
    const auto last = static_cast<shm::ConnectionIndex>(rules.size() - 1);
    model.ports.push_back({"/to", true, reads, std::move(rules), last > 0, last > 0});
    const auto words = rules::flatten(model, {id_of, [](const std::string&) { return 0u; }});
    words_ = std::vector<shm::Atomic<shm::Word>>(words.size());
    for (std::size_t i = 0; i < words.size(); ++i) words_[i] = words[i];
    view_ = shm::TableView(words_.data(), static_cast<shm::Word>(words_.size()));
    for (shm::SourceId id = 0; id < activities_.size(); ++id) {
      shm::Activity& activity = activities_[id].of(id);
      pages_->attach(id, &activity);
      activity.word = id % 2 != 0 ? shm::arrival(kNow - 1, kHour) : shm::deactivation(kNow - 1);
    }
    reads_.resize(shm::BoundRule::reads_of(view_.rule(last)));
    rule_.bind(view_.rule(last), *pages_, reads_.data(), false);
  }

  // Nothing has changed since the last decision: all are looked at once.
  shm::Verdict decide() {
    shm::DecisionClock clock(kNow, true);
    return rule_.decide(view_, clock);
  }

  // One has arrived since, and was active before.
  shm::Verdict decide_after_a_renewal() {
    shm::Activity& renewed = activities_[1].of(1);
    renewed.word = renewed.word + 1;
    return decide();
  }

  // One has become active or inactive: the rule is looked through again.
  shm::Verdict decide_after_a_change() {
    shm::Activity& changed = activities_[1].of(1);
    const bool was_active = !shm::is_deactivation(changed.word);
    ++changes_;
    changed.write(was_active ? shm::deactivation(kNow - 1 - changes_)
                             : shm::arrival(kNow - 1 - changes_, kHour),
                  !was_active, kNow - 1 - changes_);
    return decide();
  }

 private:
  static shm::SourceId id_of(const std::string& name) {
    return name == "/from" ? 0 : static_cast<shm::SourceId>(std::stoi(name.substr(2)) - 999);
  }

  std::vector<shm::ActivityPage> activities_;
  std::unique_ptr<shm::ActivityPages> pages_ = std::make_unique<shm::ActivityPages>();
  std::vector<shm::Atomic<shm::Word>> words_;
  shm::TableView view_;
  std::vector<shm::Read> reads_;
  shm::BoundRule rule_;
  shm::Nanoseconds changes_ = 0;
};

// All must be as they are: nothing denies it early.
rules::CompiledRule conjunction(std::size_t size) {
  rules::CompiledRule rule;
  rule.kind = shm::table::kConjunction;
  for (std::size_t i = 0; i < size; ++i) {
    rule.reads.push_back(source(i));
    rule.expected.push_back(i % 2 == 0);  // source(i) has id i + 1
  }
  return rule;
}

// Whether an even number is active: the diagram that needs every source on each of its paths. Two
// nodes for each source but the first: for "even so far" and for "odd so far".
rules::CompiledRule parity(shm::Word size) {
  rules::CompiledRule rule;
  rule.kind = shm::table::kDiagram;
  for (shm::Word i = 0; i < size; ++i) {
    rule.reads.push_back(source(i));
    const bool last = i + 1 == size;
    const shm::Word even = last ? shm::table::kTrue : 2 * i + 1;
    const shm::Word odd = last ? shm::table::kFalse : 2 * i + 2;
    rule.nodes.push_back({i, even, odd});
    if (i != 0) rule.nodes.push_back({i, odd, even});
  }
  return rule;
}

// As with conflict="first": of each of `size` sources a connection, whose rule says that three
// others are inactive, and does not hold. The last one, without a condition, wins.
std::vector<rules::CompiledRule> in_order(std::size_t size) {
  std::vector<rules::CompiledRule> rules;
  for (std::size_t i = 0; i < size; ++i) {
    auto& rule = rules.emplace_back();
    rule.source = source(i);
    rule.kind = shm::table::kConjunction;
    for (const std::size_t other : {1u, 2u, 4u}) rule.reads.push_back(source((i + other) % size));
    rule.expected.assign(rule.reads.size(), false);
  }
  rules.emplace_back().kind = shm::table::kAlways;
  return rules;
}

std::vector<std::string> sources(std::size_t size) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < size; ++i) names.push_back(source(i));
  return names;
}

void count_decision(const std::string& measure, const std::vector<rules::CompiledRule>& rules,
                    std::size_t reads) {
  Table table(rules, sources(reads));
  shm::Verdict verdict = shm::Verdict::kBlind;
  count_after(10, measure, kTimes, [&] { verdict = table.decide(); });
  count_after(10, measure + ", one renewed", kTimes,
              [&] { verdict = table.decide_after_a_renewal(); });
  if (rules.size() > 1) {
    count_after(10, measure + ", one changed", kTimes,
                [&] { verdict = table.decide_after_a_change(); });
  }
  if (verdict != shm::Verdict::kWins) throw std::runtime_error("must win: " + measure);
}

}  // namespace

void count_decisions() {
  for (const std::size_t size : {1u, 8u, 64u, 256u}) {
    count_decision("decide, conjunction of " + std::to_string(size), {conjunction(size)}, size);
  }
  for (const shm::Word size : {8u, 64u}) {
    count_decision("decide, diagram of " + std::to_string(size), {parity(size)}, size);
  }
  for (const std::size_t size : {8u, 64u, 254u}) {
    count_decision("decide, " + std::to_string(size) + " rules in order", in_order(size), size);
  }
}

}  // namespace arbiter::bench
