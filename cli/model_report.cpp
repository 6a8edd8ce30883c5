#include "cli/model_report.hpp"

#include <optional>

#include <nlohmann/json.hpp>

#include "cli/why_report.hpp"
#include "shm/utf8.hpp"

namespace arbiter::cli {
namespace {

using nlohmann::json;
using watch::FileNow;
using watch::ModelInForce;

json or_null(const std::optional<std::string>& text) { return text ? json(*text) : json(nullptr); }

}  // namespace

std::string how_text(const ModelInForce& model) {
  if (!model.how()) return "";
  return " (" + *model.how() + (model.by() ? ", by " + *model.by() : "") + ')';
}

std::string news_text(const evidence::ModelChange& model) {
  std::string text =
      model.generation == 0 ? "no model" : "model " + std::to_string(model.generation);
  if (!model.name.empty()) text += " \"" + shm::printable(model.name) + '"';
  text += model.generation == 0 ? " was in force any more" : " came into force";
  if (model.how.empty()) return text;
  const std::string by = model.by.empty() ? "" : ", by " + shm::printable(model.by);
  return text + " (" + shm::printable(model.how) + by + ')';
}

std::string origin_text(const ModelInForce& model, shm::Nanoseconds now) {
  if (model.since() == 0) return ", in force since before this daemon came";
  return ", in force for " + span_text(now - model.since()) + how_text(model);
}

std::string file_advice(FileNow::State state, bool is_older) {
  switch (state) {
    case FileNow::State::kSame:
      return {};
    case FileNow::State::kGone:
      return " no longer exists: arbiter reload would be refused";
    case FileNow::State::kUnreadable:
      return " cannot be read from here, so it is not known whether it has changed";
    case FileNow::State::kChanged:
      break;
  }
  return is_older ? " differs from the model in force, which is an older one, after a rollback; "
                    "arbiter reload would replace it by the file's (arbiter reload --dry-run shows "
                    "what that changes)"
                  : " has changed since; arbiter reload puts it in force, unless it has errors "
                    "(arbiter reload --dry-run checks it)";
}

json model_json(const ModelInForce& model) {
  const rules::ModelTexts& texts = model.texts();
  json files = json::array();
  for (const auto& file : texts.models) files.push_back(file.path);
  json changed = json::array();
  json missing = json::array();
  json unreadable = json::array();
  for (const FileNow& file : model.files_now()) {
    const bool is_gone = file.state == FileNow::State::kGone;
    if (is_gone) missing.push_back(file.path);
    if (is_gone || file.state == FileNow::State::kChanged) changed.push_back(file.path);
    if (file.state == FileNow::State::kUnreadable) unreadable.push_back(file.path);
  }
  return {{"generation", model.generation()},
          {"name", or_null(model.name())},
          {"files", std::move(files)},
          {"application", texts.application ? json(texts.application->path) : json(nullptr)},
          {"changed_files", std::move(changed)},
          {"missing_files", std::move(missing)},
          {"unreadable_files", std::move(unreadable)},
          {"is_older", model.is_older()},
          {"in_force_since_ns", model.since() == 0 ? json(nullptr) : json(model.since())},
          {"how", or_null(model.how())},
          {"by", or_null(model.by())},
          {"provenance_known", model.has_texts()}};
}

}  // namespace arbiter::cli
