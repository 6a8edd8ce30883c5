// The model in force with the rules that its texts make, loaded once for all who ask about them.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "rules/model/rule_set.hpp"
#include "rules/text/diagnostic.hpp"
#include "watch/instance.hpp"
#include "watch/model_in_force.hpp"

namespace arbiter::watch {

struct ModelWithRules {
  // Fetches it. Throws as Instance::ask().
  explicit ModelWithRules(Instance& instance);

  ModelInForce in_force;
  rules::Diagnostics diagnostics;
  rules::RuleSet rules;  // nothing where the daemon does not know its texts
};

// Thread safety: none; it belongs to the thread of its instance.
class ModelLoader {
 public:
  explicit ModelLoader(std::shared_ptr<Instance> instance) : instance_(std::move(instance)) {}

  // The last one that was loaded, if it is of that generation and the daemon is the same; else the
  // one that is in force by now, which may be a later one. Throws as Instance::ask(), and
  // WatchError where this program cannot read it.
  std::shared_ptr<const ModelWithRules> load(std::uint64_t generation);

 private:
  const std::shared_ptr<Instance> instance_;
  std::shared_ptr<const ModelWithRules> last_;
  std::uint64_t daemon_ = 0;  // that was asked for it
};

}  // namespace arbiter::watch
