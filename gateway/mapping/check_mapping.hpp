// What a mapping says, beside a model and beside other mappings: ports that nobody mentions or that
// two entries have, topics that go in a circle, types that cannot meet.
#pragma once

#include <vector>

#include "gateway/mapping/mapping.hpp"
#include "rules/model/rule_set.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::gateway {

// Of mappings that were read without an error. Without a model (null): what can be said of the
// mappings alone, which is what a gateway looks at when it starts.
void check_mappings(const std::vector<Mapping>& mappings, const rules::RuleSet* model,
                    rules::Diagnostics& diagnostics);

}  // namespace arbiter::gateway
