// Where the rules of a model come from: its behaviours, who contains whom, who inhibits whom.
//
// Extraction joins all that into rules, and a rule alone does not tell which inhibition put a
// source into it. To keep that of each term would take many times the room of the model (there may
// be millions of them), while hardly anyone asks. So the model is kept, and whoever explains a rule
// (explain.hpp) derives its terms again, for the one port that is asked for.
#pragma once

#include <cstddef>
#include <string>

#include "rules/model/hierarchy.hpp"
#include "rules/model/model.hpp"

namespace arbiter::rules {

struct Provenance {
  Model model;
  Hierarchy::Relations relations;  // between Model::behaviours, by index
};

// Where T of a source is written; without a file where it is the default.
inline Location place_of_timeout(const Model& model, const std::string& source) {
  for (const SourceDeclaration& each : model.sources) {
    if (each.name == source && each.timeout) return each.where;
  }
  return model.timeout ? model.timeout->where : Location();
}

}  // namespace arbiter::rules
