// Pictures of a model in DOT, the language of Graphviz: the paper's figures 2 and 3. The same model
// gives the same text.
#pragma once

#include <cstdint>
#include <string>

#include "drawing/situation.hpp"
#include "rules/model/load.hpp"

namespace arbiter::drawing {

enum class View : std::uint8_t {
  kBehaviours,   // behaviours in meta-behaviours, inhibitions, conditions (figure 3)
  kConnections,  // components and their ports, connections, rules (figure 2)
  kBoth,
};

// Behaviours where the model has some; one of rules by hand has connections only.
View natural_view(const rules::LoadedModel& model);

// With a situation it is coloured by who is active and who wins. The model must have no errors, but
// its rules need not be proved.
std::string draw(const rules::LoadedModel& model, View view, const Situation* situation = nullptr);

}  // namespace arbiter::drawing
