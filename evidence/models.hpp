// The models of a recording, compiled from the texts that it has of them.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "evidence/judge.hpp"
#include "evidence/recorded.hpp"
#include "evidence/rule_table.hpp"
#include "rules/prove/compile.hpp"

namespace arbiter::evidence {

// Compiles the model of these texts; where it has errors, throws what says so.
using Compile = std::function<rules::CompiledModel(const rules::ModelTexts&)>;

[[nodiscard]] rules::ModelTexts texts_of(const ModelChange& model);

class Models {
 public:
  explicit Models(Compile compile) : compile_(std::move(compile)) {}

  // By which decisions of that generation were taken; null: its texts are not in the recording.
  // Compiles it the first time, and again where many others were asked for meanwhile: a recording
  // may have more models than memory. Throws what `compile` throws.
  std::shared_ptr<Judge> judge(const Run& run, std::uint64_t generation);

 private:
  const Compile compile_;
  std::map<const ModelChange*, std::shared_ptr<Judge>> judges_;
};

// The table and names of a simulation, which must outlive it, as it does in what `owner` keeps.
[[nodiscard]] std::shared_ptr<const RuleTable> rule_table_of(
    const rules::Simulation& simulation, std::shared_ptr<const void> owner = nullptr);

}  // namespace arbiter::evidence
