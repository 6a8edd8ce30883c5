#include "rules/model/load.hpp"

#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "rules/model/application_reader.hpp"
#include "rules/model/document_order.hpp"
#include "rules/model/doubt.hpp"
#include "rules/model/extraction.hpp"
#include "rules/model/hierarchy.hpp"
#include "rules/model/model.hpp"
#include "rules/model/model_checks.hpp"
#include "rules/model/model_reader.hpp"
#include "rules/model/name_checks.hpp"
#include "rules/model/provenance.hpp"
#include "rules/text/defines.hpp"
#include "rules/text/names.hpp"
#include "rules/text/text_file.hpp"

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

void read_all(const ModelTexts& texts, Defines& defines, LoadedModel& loaded,
              Diagnostics& diagnostics) {
  std::set<std::string> read;
  Defines::LaterFiles later;
  for (const FileText& each : texts.models) later.emplace_back(each.path, each.content);
  for (const FileText& each : texts.models) {
    later.erase(later.begin());
    defines.expect_later(later);
    if (!read.insert(each.path).second) {
      diagnostics.error("duplicate-file", {each.path, 1, 1},
                        "this file is given twice; give it once");
      continue;
    }
    const TextFile file(each.path, each.content);
    const bool is_application = read_model(file, defines, loaded.model, diagnostics);
    if (is_application && !texts.application) add_application(file, loaded, diagnostics);
  }
  if (!texts.application) return;
  const TextFile file(texts.application->path, texts.application->content);
  loaded.application = read_application(file, diagnostics);
}

// `relations`: where they are to be put; null: nowhere.
LoadedModel load_all(const ModelTexts& texts, Diagnostics& diagnostics,
                     Hierarchy::Relations* relations) {
  std::vector<std::string> paths;
  for (const FileText& file : texts.models) paths.push_back(file.path);
  if (texts.application) paths.push_back(texts.application->path);
  const DocumentOrder order(paths);

  Diagnostics found;
  LoadedModel loaded;
  Defines defines;
  read_all(texts, defines, loaded, found);
  const std::optional<Application>& application = loaded.application;
  check_sources(loaded.model, found);
  Hierarchy hierarchy(loaded.model, found);
  RuleSet& rules = loaded.rules = extract_rules(loaded.model, hierarchy, found);
  if (application) check_application(*application, loaded.model, rules, found);
  const Location whole{paths.empty() ? "" : paths.front(), 1, 1};
  check_limits(rules, application ? &*application : nullptr, whole, order, found);
  bool has_all_names = true;
  if (found.has_errors()) {
    const Doubts doubts = find_doubts(loaded.model, hierarchy, found);
    for (PortRules& port : rules.ports) port.is_doubtful = doubts.about(port.port);
    has_all_names = !doubts.everything && !may_lack_names(loaded.model, application);
  } else {
    defines.note_unused(found);
    note_commands_forever(loaded.model, rules, whole, found);
    if (application) note_unarbitrated(*application, rules, found);
  }
  const RuleSet* sound = found.has_errors() ? nullptr : &rules;
  if (has_all_names) check_names(loaded.model, application, sound, whole, order, found);
  // Checks go through a model in various orders; the reader of their findings goes through files.
  found.sort_by_place(order);
  diagnostics.add(std::move(found));
  if (relations != nullptr) *relations = std::move(hierarchy).release();
  return loaded;
}

}  // namespace

ModelTexts read_texts(const ModelFiles& files, Accept accept) {
  std::string problems;
  const auto read = [&](const std::string& path) -> FileText {
    try {
      return {path, read_bytes(path, kMaxFileBytes, accept)};
    } catch (const FileError& error) {
      problems += (problems.empty() ? "" : "; ") + std::string(error.what());
      if (const auto parts = files_in(path); !parts.empty()) {
        problems += "; " + enumerate(parts) + " are files: give each of them by itself";
      }
      return {};
    }
  };
  ModelTexts texts;
  for (const std::string& path : files.models) texts.models.push_back(read(path));
  if (files.application) texts.application = read(*files.application);
  if (!problems.empty()) throw FileError(problems);
  return texts;
}

LoadedModel load_all(const ModelTexts& texts, Diagnostics& diagnostics) {
  return load_all(texts, diagnostics, nullptr);
}

RuleSet load(ModelTexts texts, Diagnostics& diagnostics, Keep keep) {
  const bool keeps_provenance = keep == Keep::kProvenance;
  Hierarchy::Relations relations;
  LoadedModel loaded = load_all(texts, diagnostics, keeps_provenance ? &relations : nullptr);
  if (keeps_provenance) {
    loaded.rules.provenance = std::make_shared<const Provenance>(
        Provenance{std::move(loaded.model), std::move(relations)});
  }
  loaded.rules.texts = std::make_shared<const ModelTexts>(std::move(texts));
  return std::move(loaded.rules);
}

RuleSet load(const ModelFiles& files, Diagnostics& diagnostics, Keep keep) {
  return load(read_texts(files), diagnostics, keep);
}

}  // namespace arbiter::rules
