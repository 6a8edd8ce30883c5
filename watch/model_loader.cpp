#include "watch/model_loader.hpp"

#include <utility>

#include "rules/model/load.hpp"
#include "watch/watch_error.hpp"

namespace arbiter::watch {

ModelWithRules::ModelWithRules(Instance& instance)
    : in_force(ModelInForce::fetch(instance)),
      rules(in_force.has_texts()
                ? rules::load(in_force.texts(), diagnostics, rules::Keep::kProvenance)
                : rules::RuleSet()) {}

std::shared_ptr<const ModelWithRules> ModelLoader::load(std::uint64_t generation) {
  const std::uint64_t daemon = instance_->daemons();
  if (last_ != nullptr && daemon == daemon_ && last_->in_force.generation() == generation) {
    return last_;
  }
  auto model = std::make_shared<const ModelWithRules>(*instance_);
  if (model->diagnostics.has_errors()) {
    throw WatchError("this program cannot read the daemon's model; are both of one version?");
  }
  daemon_ = daemon;  // if another one has answered, the next who asks loads it again
  return last_ = std::move(model);
}

}  // namespace arbiter::watch
