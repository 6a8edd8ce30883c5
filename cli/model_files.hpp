// What all verbs that look at a model have in common.
#pragma once

#include <optional>
#include <string>

#include "rules/model/load.hpp"
#include "rules/prove/compile.hpp"
#include "rules/text/diagnostic.hpp"

namespace CLI {
class App;
class Option;
class Validator;
}  // namespace CLI

namespace arbiter::cli {

// Takes "-" for standard input, as -o takes it for standard output. Only one file of a command
// line may be that: whoever reads it again finds nothing. What is wrong; empty: nothing.
std::string take_input(std::string& file);
CLI::Validator dash_for_input();

// MODEL..., which it gives back, and --application.
CLI::Option& add_model_options(CLI::App& verb, rules::ModelFiles& files);

// --effort
void add_effort_option(CLI::App& verb, double& effort);

struct Model {
  rules::RuleSet rules;
  rules::CompiledModel compiled;
};

// Reads, compiles and proves a model; nothing if that finds an error.
std::optional<Model> load_model(const rules::ModelFiles& files, rules::Diagnostics& diagnostics,
                                rules::Budget& budget, rules::Keep keep = rules::Keep::kRules);
// With a budget of its own, as check has it, so that what is accepted there is accepted everywhere;
// and with its progress on standard error. Drops notes: see Diagnostics::drop_notes.
std::optional<Model> load_model(const rules::ModelFiles& files, rules::Diagnostics& diagnostics,
                                double effort, rules::Keep keep = rules::Keep::kRules);
// The same of rules that are read already.
rules::CompiledModel compile_model(const rules::RuleSet& rules, rules::Diagnostics& diagnostics,
                                   double effort);

}  // namespace arbiter::cli
