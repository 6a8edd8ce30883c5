#include "cli/model_in_force.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

#include "cli/live.hpp"
#include "cli/why_report.hpp"
#include "rules/text/names.hpp"

namespace arbiter::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kReplacement = "\xEF\xBF\xBD";  // U+FFFD

std::string text_or_nothing(const json& value) {
  return value.is_null() ? std::string() : value.get<std::string>();
}

FileNow::State state_of(const rules::FileText& file) {
  std::error_code error;
  const auto status = fs::status(file.path, error);
  if (status.type() == fs::file_type::not_found) return FileNow::State::kGone;
  if (status.type() != fs::file_type::regular) return FileNow::State::kUnreadable;
  std::ifstream stream(file.path, std::ios::binary);
  const std::string now{std::istreambuf_iterator<char>(stream), {}};
  if (!stream.is_open() || stream.bad()) return FileNow::State::kUnreadable;
  // What was not UTF-8 is not as it was read.
  const bool is_whole = file.content.find(kReplacement) == std::string::npos;
  return is_whole && now != file.content ? FileNow::State::kChanged : FileNow::State::kSame;
}

}  // namespace

std::string path_from_here(const std::string& path, const std::string& directory) {
  std::error_code error;
  const fs::path here = fs::current_path(error);
  const fs::path whole = (fs::path(directory) / path).lexically_normal();
  if (error || !whole.is_absolute()) return path;
  const fs::path relative = whole.lexically_relative(here);
  const bool is_below = !relative.empty() && *relative.begin() != "..";
  return is_below ? relative.string() : whole.string();
}

ModelInForce ModelInForce::fetch(detail::NodeCore& node) {
  const json document = fetch_document(node, shm::MessageKind::kModel);
  ModelInForce model;
  model.generation_ = document.at("generation").get<std::uint64_t>();
  model.name_ = text_or_nothing(document.at("name"));
  model.how_ = text_or_nothing(document.at("how"));
  model.by_ = text_or_nothing(document.at("by"));
  model.is_older_ = document.at("as_loaded") == false;
  model.has_texts_ = document.at("known").get<bool>();
  model.since_ = document.at("in_force_since_ns").get<shm::Nanoseconds>();
  const auto directory = document.at("directory").get<std::string>();
  const auto file_of = [&](const json& file) {
    return rules::FileText{path_from_here(file.at("path").get<std::string>(), directory),
                           file.at("text").get<std::string>()};
  };
  for (const auto& file : document.at("models")) model.texts_.models.push_back(file_of(file));
  if (!document.at("application").is_null()) {
    model.texts_.application = file_of(document.at("application"));
  }
  for (const auto& [port, since] : document.at("ports_since_ns").items()) {
    model.ports_since_[port] = since.get<shm::Nanoseconds>();
  }
  for (const auto& [source, past] : document.at("timeouts_before").items()) {
    const json& timeout = past.at("timeout_ns");
    model.timeouts_before_[source] = {
        timeout.is_string() ? shm::kForever : timeout.get<shm::Nanoseconds>(),
        past.at("until_ns").get<shm::Nanoseconds>(), past.at("word").get<shm::ActivityWord>()};
  }
  model.others_ = document.at("others");
  return model;
}

shm::Nanoseconds ModelInForce::since(const std::string& port) const {
  const auto found = ports_since_.find(port);
  return found == ports_since_.end() ? since_ : found->second;
}

std::optional<ModelInForce::PastTimeout> ModelInForce::timeout_before(
    const std::string& source) const {
  const auto found = timeouts_before_.find(source);
  return found == timeouts_before_.end() ? std::nullopt : std::optional(found->second);
}

std::string ModelInForce::text() const {
  if (is_none()) return "no model";
  std::string text = "model " + std::to_string(generation_);
  if (!name_.empty()) text += " \"" + name_ + '"';
  if (texts_.models.empty()) return text;
  text += " (" + texts_.models.front().path;
  if (const auto more = texts_.models.size() - 1; more != 0) {
    text += " and " + std::to_string(more) + " more";
  }
  return text + ')';
}

std::string ModelInForce::origin_text(shm::Nanoseconds now) const {
  std::string text = since_ == 0 ? std::string(", in force since before this daemon came")
                                 : ", in force since " + span_text(now - since_) + " ago";
  return since_ == 0 ? text : text + how_text();
}

std::string ModelInForce::how_text() const {
  return how_.empty() ? "" : " (" + how_ + (by_.empty() ? "" : ", by " + by_) + ')';
}

json ModelInForce::to_json() const {
  const auto or_null = [](const std::string& text) { return text.empty() ? json() : json(text); };
  json files = json::array();
  for (const auto& file : texts_.models) files.push_back(file.path);
  json changed = json::array();
  json missing = json::array();
  json unreadable = json::array();
  for (const auto& file : files_now()) {
    const bool is_gone = file.state == FileNow::State::kGone;
    if (is_gone) missing.push_back(file.path);
    if (is_gone || file.state == FileNow::State::kChanged) changed.push_back(file.path);
    if (file.state == FileNow::State::kUnreadable) unreadable.push_back(file.path);
  }
  return {{"generation", generation_},
          {"name", or_null(name_)},
          {"files", std::move(files)},
          {"application", texts_.application ? json(texts_.application->path) : json()},
          {"changed_files", std::move(changed)},
          {"missing_files", std::move(missing)},
          {"unreadable_files", std::move(unreadable)},
          {"is_older", is_older_},
          {"in_force_since_ns", since_ == 0 ? json() : json(since_)},
          {"how", or_null(how_)},
          {"by", or_null(by_)},
          {"provenance_known", has_texts_}};
}

std::vector<FileNow> ModelInForce::files_now() const {
  std::vector<FileNow> files;
  for (const auto& file : texts_.models) files.push_back({file.path, state_of(file)});
  if (texts_.application) {
    files.push_back({texts_.application->path, state_of(*texts_.application)});
  }
  return files;
}

std::optional<std::string> ModelInForce::other_that_mentions(
    const std::string& port, const std::optional<std::string>& source) const {
  for (const auto& model : others_) {
    const auto found = model.at("ports").find(port);
    if (found == model.at("ports").end()) continue;
    if (!source || std::find(found->begin(), found->end(), *source) != found->end()) {
      return model.at("name").get<std::string>();
    }
  }
  return std::nullopt;
}

}  // namespace arbiter::cli
