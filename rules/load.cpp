#include "rules/load.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "rules/application_reader.hpp"
#include "rules/defines.hpp"
#include "rules/document_order.hpp"
#include "rules/extraction.hpp"
#include "rules/hierarchy.hpp"
#include "rules/model.hpp"
#include "rules/model_checks.hpp"
#include "rules/model_reader.hpp"
#include "rules/provenance.hpp"
#include "rules/text_file.hpp"

namespace arbiter::rules {
namespace {

Model read_models(const std::vector<FileText>& files, Diagnostics& diagnostics) {
  Model model;
  Defines defines;
  std::set<std::string> read;
  for (const FileText& file : files) {
    if (!read.insert(file.path).second) {
      diagnostics.error("duplicate-file", {file.path, 1, 1},
                        "this file is given twice; give it once");
      continue;
    }
    read_model(TextFile(file.path, file.content), defines, model, diagnostics);
  }
  return model;
}

std::optional<Application> read_application_if_any(const ModelTexts& texts,
                                                   Diagnostics& diagnostics) {
  if (!texts.application) return {};
  return read_application(TextFile(texts.application->path, texts.application->content),
                          diagnostics);
}

// Checks go through a model in various orders; the reader of their findings goes through files.
void hand_over_sorted(const Diagnostics& found, const DocumentOrder& order,
                      Diagnostics& diagnostics) {
  std::vector<const Diagnostic*> sorted;
  for (const Diagnostic& item : found.items()) sorted.push_back(&item);
  std::stable_sort(sorted.begin(), sorted.end(), [&](const Diagnostic* a, const Diagnostic* b) {
    return order(a->where, b->where);
  });
  const bool is_cut = found.dropped() > 0;
  if (is_cut) sorted.pop_back();  // makes room for the last word
  for (const Diagnostic* item : sorted) {
    switch (item->severity) {
      case Severity::kError:
        diagnostics.error(item->code, item->where, item->message, item->witness);
        break;
      case Severity::kWarning:
        diagnostics.warning(item->code, item->where, item->message);
        break;
      case Severity::kNote:
        diagnostics.note(item->code, item->where, item->message);
        break;
    }
  }
  if (is_cut) {
    diagnostics.error("too-many-problems", sorted.back()->where,
                      std::to_string(found.dropped() + 1) +
                          " more problems are not shown; correct the ones above first");
  }
}

}  // namespace

ModelTexts read_texts(const ModelFiles& files) {
  ModelTexts texts;
  for (const std::string& path : files.models) texts.models.push_back({path, read_bytes(path)});
  if (files.application) {
    texts.application = FileText{*files.application, read_bytes(*files.application)};
  }
  return texts;
}

RuleSet load(ModelTexts texts, Diagnostics& diagnostics, Keep keep) {
  std::vector<std::string> paths;
  for (const FileText& file : texts.models) paths.push_back(file.path);
  if (texts.application) paths.push_back(texts.application->path);
  const DocumentOrder order(paths);

  Diagnostics found;
  Model model = read_models(texts.models, found);
  const std::optional<Application> application = read_application_if_any(texts, found);
  check_sources(model, found);
  Hierarchy hierarchy(model, found);
  RuleSet rules = extract_rules(model, hierarchy, found);
  if (application) check_application(*application, rules, found);
  const Location whole{paths.empty() ? "" : paths.front(), 1, 1};
  check_limits(rules, application ? &*application : nullptr, whole, order, found);
  hand_over_sorted(found, order, diagnostics);
  if (keep == Keep::kProvenance) {
    Hierarchy::Relations relations = std::move(hierarchy).release();
    rules.provenance =
        std::make_shared<const Provenance>(Provenance{std::move(model), std::move(relations)});
  }
  rules.texts = std::make_shared<const ModelTexts>(std::move(texts));
  return rules;
}

RuleSet load(const ModelFiles& files, Diagnostics& diagnostics, Keep keep) {
  return load(read_texts(files), diagnostics, keep);
}

}  // namespace arbiter::rules
