// From files to rules: reads the model and application files, checks them, extracts the rules.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "rules/model/model.hpp"
#include "rules/model/model_texts.hpp"
#include "rules/model/rule_set.hpp"
#include "rules/text/diagnostic.hpp"
#include "rules/text/text_file.hpp"

namespace arbiter::rules {

struct ModelFiles {
  std::vector<std::string> models;  // together they form one model
  std::optional<std::string> application;
};

// Throws FileError.
ModelTexts read_texts(const ModelFiles& files, Accept accept = Accept::kAnyFile);

// Reports all problems of all files in one go; the result is to be used only if there is no error.
// The provenance is kept for those who want to explain the rules: it is as large as the model.
enum class Keep { kRules, kProvenance };
RuleSet load(ModelTexts texts, Diagnostics& diagnostics, Keep keep = Keep::kRules);
// The same of files. Throws FileError.
RuleSet load(const ModelFiles& files, Diagnostics& diagnostics, Keep keep = Keep::kRules);

// The rules, with what they were made of.
struct LoadedModel {
  Model model;
  std::optional<Application> application;  // given, or a model's file is one itself
  RuleSet rules;
};
LoadedModel load_all(const ModelTexts& texts, Diagnostics& diagnostics);

}  // namespace arbiter::rules
