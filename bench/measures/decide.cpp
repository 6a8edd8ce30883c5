// The decision alone, by the size of its rule.
#include <memory>
#include <vector>

#include "bench/harness/batches.hpp"
#include "bench/measures/measures.hpp"
#include "shm/clock.hpp"
#include "shm/decision.hpp"
#include "shm/segment.hpp"

namespace arbiter::bench {
namespace {

// A table with one rule over so many sources, and their pages, as the daemon would make them.
class OneRule {
 public:
  OneRule(int sources, shm::table::RuleKind kind) : words_(shm::table::kHeaderWords) {
    using namespace shm::table;
    const auto count = static_cast<shm::Word>(sources);
    map_pages(count);
    const shm::Word connection = size();
    words_.resize(words_.size() + kConnectionWords);
    const shm::Word reads = size();
    for (shm::Word i = 0; i < count; ++i) words_.push_back(i);  // each must be inactive
    const shm::Word nodes = size();
    if (kind == kDiagram) push_nodes(count);
    words_[kMagicAt] = kMagic;
    words_[kVersionAt] = kVersion;
    words_[kDefaultTimeoutLowAt] = 500'000'000;
    words_[kConnectionCountAt] = 1;
    words_[kConnectionsAt] = connection;
    words_[connection + kConnectionSource] = count;
    words_[connection + kRuleKind] = kind;
    words_[connection + kFirstRead] = reads;
    words_[connection + kReadCount] = count;
    words_[connection + kFirstNode] = nodes;
    words_[connection + kNodeCount] = kind == kDiagram ? nodes_ : 0;
    words_[kTotalWordsAt] = size();
    shared_ = std::vector<shm::Atomic<shm::Word>>(words_.size());
    for (std::size_t i = 0; i < words_.size(); ++i) {
      shared_[i].store(words_[i], std::memory_order_relaxed);
    }
    view_ = shm::TableView(shared_.data(), size());
    reads_.resize(count);
    rule_.bind(view_.rule(0), *pages_, reads_.data(), false);
  }
  OneRule(const OneRule&) = delete;
  OneRule& operator=(const OneRule&) = delete;

  void operator()() {
    shm::DecisionClock clock(1, true);
    keep(rule_.decide(view_, clock));
  }

 private:
  [[nodiscard]] shm::Word size() const { return static_cast<shm::Word>(words_.size()); }

  // Each in a segment of its own, as the daemon hands them out: apart in memory, and in the TLB.
  void map_pages(shm::Word count) {
    for (shm::Word i = 0; i < count; ++i) {
      const auto segment = shm::make_segment("activity", sizeof(shm::ActivityPage));
      mappings_.emplace_back(segment, sizeof(shm::ActivityPage), shm::Access::kReadWrite);
      shm::Activity& activity = mappings_.back().as<shm::ActivityPage>()->of(i);
      activity.word.store(shm::kNeverActive, std::memory_order_relaxed);
      pages_->attach(i, &activity);
    }
  }

  // Parity of all sources but the last two, which decide: the widest that stays small, and every
  // walk goes all the way down.
  void push_nodes(shm::Word count) {
    using namespace shm::table;
    const auto node = [&](shm::Word position, shm::Word low, shm::Word high) {
      words_.insert(words_.end(), {position, low, high});
      ++nodes_;
    };
    node(0, count == 1 ? kTrue : 1, count == 1 ? kFalse : 2);
    for (shm::Word level = 1; level < count; ++level) {
      const shm::Word first = 2 * level - 1;  // even so far; then odd
      const bool last = level + 1 == count;
      node(level, last ? kTrue : first + 2, last ? kFalse : first + 3);
      node(level, last ? kFalse : first + 3, last ? kTrue : first + 2);
    }
  }

  std::vector<shm::Word> words_;
  shm::Word nodes_ = 0;
  std::vector<shm::Atomic<shm::Word>> shared_;
  shm::TableView view_;
  std::vector<shm::Read> reads_;
  shm::BoundRule rule_;
  std::unique_ptr<shm::ActivityPages> pages_ = std::make_unique<shm::ActivityPages>();
  std::vector<shm::Mapping> mappings_;
};

Contender decision(const std::string& system, int sources, shm::table::RuleKind kind) {
  return in_batches(system, Role::kOurs, 64,
                    [=] { return [it = std::make_shared<OneRule>(sources, kind)] { (*it)(); }; });
}

}  // namespace

Measure measure_decide(const Effort& effort) {
  Measure measure{"decide", "The decision alone",
                  "A rule over so many sources, none of them active, nobody publishing: one "
                  "consistent picture of them all. Mean of batches of 64."};
  measure.x_label = "sources";
  for (const int sources : {1, 2, 8, 16, 64, 256}) {
    Case one{std::to_string(sources) + (sources == 1 ? " source" : " sources")};
    one.x = sources;
    std::vector<Contender> contenders;
    contenders.push_back(decision("conjunction", sources, shm::table::kConjunction));
    contenders.push_back(decision("diagram (parity)", sources, shm::table::kDiagram));
    one.results = run_rounds(std::move(contenders), effort.budget());
    measure.cases.push_back(std::move(one));
  }
  return measure;
}

}  // namespace arbiter::bench
