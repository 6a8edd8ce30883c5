// Recordings that are made up, step by step.
#pragma once

#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "evidence/models.hpp"
#include "evidence/record_writer.hpp"
#include "evidence/recorded.hpp"
#include "rules/model/load.hpp"
#include "rules/prove/compile.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {

inline const std::string kOverride = R"(<behaviors timeout="500ns">
  <behavior name="Low"><config at="/p">/low</config></behavior>
  <behavior name="High"><config at="/p">/high</config><inhibition>Low</inhibition></behavior>
</behaviors>
)";
// The other way round.
inline const std::string kReversed = R"(<behaviors timeout="500ns">
  <behavior name="Low"><config at="/p">/low</config><inhibition>High</inhibition></behavior>
  <behavior name="High"><config at="/p">/high</config></behavior>
</behaviors>
)";

inline rules::CompiledModel compile_texts(const rules::ModelTexts& texts) {
  rules::Diagnostics diagnostics;
  auto compiled = rules::compile(rules::load(texts, diagnostics), diagnostics);
  if (diagnostics.has_errors()) throw std::runtime_error("the model has errors");
  return compiled;
}
inline rules::CompiledModel compile_text(const std::string& text) {
  return compile_texts({{{"model.xml", text}}, {}});
}

// It begins at 1000, with sources that have never been active.
class Incident {
 public:
  enum class Fate { accepted, discarded, refused, blind, none };  // none: only sensed

  explicit Incident(const std::string& model = kOverride,
                    const std::vector<std::string>& sources = {"/low", "/high"},
                    std::vector<std::string> ports = {}) {
    add(evidence::Start{1000, "test", std::move(ports), "none"});
    for (const std::string& source : sources) state(source, 0, 990, shm::kNeverActive);
    put_in_force(model, 1, 900);
  }

  void add(evidence::Record record) { records_.push_back(std::move(record)); }
  void put_in_force(const std::string& model, std::uint64_t generation, shm::Nanoseconds time) {
    evidence::ModelChange change;
    change.time = time;
    change.seen = time;
    change.generation = generation;
    change.has_texts = true;
    change.files = {{"model.xml", model}};
    add(change);
    generation_ = generation;
  }
  void state(const std::string& source, shm::Nanoseconds time, shm::Nanoseconds seen,
             shm::ActivityWord word,
             evidence::SourceState::Why why = evidence::SourceState::Why::page,
             std::uint64_t lost = 0) {
    evidence::SourceState state;
    state.context = context(source);
    state.time = time;
    state.seen = seen;
    state.why = why;
    state.lost = lost;
    state.word = word;
    state.generation = generation_;
    add(state);
  }
  // At /p.
  void arrive(const std::string& source, shm::Nanoseconds time, shm::Nanoseconds seen, Fate fate,
              shm::Nanoseconds timeout = 500) {
    evidence::Arrival arrival;
    arrival.context = context(source);
    arrival.time = time;
    arrival.seen = seen;
    arrival.is_sample = true;
    arrival.sequence = ++sequences_[source];
    arrival.size = 8;
    arrival.generation = generation_;
    arrival.word = shm::arrival(time, timeout);
    std::uint64_t* const masks[] = {&arrival.masks.accepted, &arrival.masks.discarded,
                                    &arrival.masks.refused, &arrival.masks.blind};
    if (fate != Fate::none) *masks[static_cast<int>(fate)] = 1;
    add(arrival);
  }
  // In the last arrival.
  void put_payload(std::size_t bytes) {
    auto& arrival = std::get<evidence::Arrival>(records_.back());
    arrival.size = bytes;
    arrival.payload.emplace(bytes);
  }
  void deactivate(const std::string& source, shm::Nanoseconds time, shm::Nanoseconds seen) {
    add(evidence::Deactivation{context(source), time, seen, sequences_[source], generation_});
  }

  // Written and read. `end`: what the file says of when recording ended; 0: nothing.
  [[nodiscard]] std::string file(shm::Nanoseconds end = 0) {
    const std::string path = directory_.path() + "/" + std::to_string(++files_) + ".mcap";
    evidence::RecordWriter writer(path, {}, {"program", "test", "host", "command", 5'000'000});
    for (const auto& record : records_) writer.write(record);
    writer.close(end);
    return path;
  }
  [[nodiscard]] evidence::Recorded read() { return evidence::load_recording(file()); }
  [[nodiscard]] const std::vector<evidence::Record>& records() const { return records_; }

 private:
  evidence::ContextPtr context(const std::string& source) {
    auto& known = contexts_[source];
    if (known == nullptr) {
      evidence::SourceContext context;
      context.source = source;
      context.is_described = true;
      context.destinations = {"/p"};
      known = std::make_shared<const evidence::SourceContext>(context);
    }
    return known;
  }

  TemporaryDirectory directory_;
  int files_ = 0;
  std::vector<evidence::Record> records_;
  std::map<std::string, evidence::ContextPtr> contexts_;
  std::map<std::string, std::uint64_t> sequences_;
  std::uint64_t generation_ = 1;
};

}  // namespace arbiter::test
