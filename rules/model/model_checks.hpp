// What is checked of a model as a whole, beside what finding its way through it takes.
#pragma once

#include "rules/model/document_order.hpp"
#include "rules/model/model.hpp"
#include "rules/model/rule_set.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::rules {

// Sources that are declared twice.
void check_sources(const Model& model, Diagnostics& diagnostics);

// Each connection that a rule selects must be in the application; those that no rule selects are
// added to the rules. What the rules read must be published, as far as the application tells.
void check_application(const Application& application, const Model& model, RuleSet& rules,
                       Diagnostics& diagnostics);

// Input ports to which the application connects several sources, and of which no rule speaks: notes
// "not-arbitrated".
void note_unarbitrated(const Application& application, const RuleSet& rules,
                       Diagnostics& diagnostics);

// Notes "forever-commands", of sources with T = forever that a rule selects somewhere. `whole` is
// the place for what cannot be pinned to a line.
void note_commands_forever(const Model& model, const RuleSet& rules, const Location& whole,
                           Diagnostics& diagnostics);

// The limits of shm/limits.hpp that a model can exceed. `whole` is the place for what cannot be
// pinned to a line. `application` may be null.
void check_limits(const RuleSet& rules, const Application* application, const Location& whole,
                  const DocumentOrder& order, Diagnostics& diagnostics);

}  // namespace arbiter::rules
