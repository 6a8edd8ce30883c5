#include "rules/load.hpp"

#include <algorithm>
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
#include "rules/text_file.hpp"

namespace arbiter::rules {
namespace {

// An application with a model in it says which connections exist, unless another one is given.
void add_application(const TextFile& file, LoadedModel& loaded, Diagnostics& diagnostics) {
  Application read = read_application(file, diagnostics);
  if (!loaded.application) loaded.application.emplace();
  auto& connections = loaded.application->connections;
  std::set<std::pair<std::string, std::string>> known;
  for (const Application::Link& link : connections) known.emplace(link.source, link.port);
  for (Application::Link& link : read.connections) {
    if (known.contains({link.source, link.port})) continue;
    connections.push_back(std::move(link));
  }
  if (read.is_incomplete) loaded.application->is_incomplete = true;
}

void read_files(const ModelFiles& files, LoadedModel& loaded, Diagnostics& diagnostics) {
  Defines defines;
  std::set<std::string> read;
  for (const std::string& path : files.models) {
    if (!read.insert(path).second) {
      diagnostics.error("duplicate-file", {path, 1, 1}, "this file is given twice; give it once");
      continue;
    }
    const TextFile file(path, read_bytes(path));
    const bool is_application = read_model(file, defines, loaded.model, diagnostics);
    if (is_application && !files.application) add_application(file, loaded, diagnostics);
  }
  if (!files.application) return;
  const TextFile file(*files.application, read_bytes(*files.application));
  loaded.application = read_application(file, diagnostics);
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
        diagnostics.note(item->code, item->where, item->message, item->witness);
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

RuleSet load(const ModelFiles& files, Diagnostics& diagnostics) {
  return std::move(load_all(files, diagnostics).rules);
}

LoadedModel load_all(const ModelFiles& files, Diagnostics& diagnostics) {
  std::vector<std::string> paths = files.models;
  if (files.application) paths.push_back(*files.application);
  const DocumentOrder order(paths);

  Diagnostics found;
  LoadedModel loaded;
  read_files(files, loaded, found);
  const std::optional<Application>& application = loaded.application;
  check_sources(loaded.model, found);
  const Hierarchy hierarchy(loaded.model, found);
  RuleSet& rules = loaded.rules = extract_rules(loaded.model, hierarchy, found);
  if (application) check_application(*application, rules, found);
  const Location whole{paths.empty() ? "" : paths.front(), 1, 1};
  check_limits(rules, application ? &*application : nullptr, whole, order, found);
  hand_over_sorted(found, order, diagnostics);
  return loaded;
}

}  // namespace arbiter::rules
