#include "cli/model_in_force.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

#include "cli/live.hpp"
#include "cli/why_report.hpp"
#include "rules/names.hpp"

namespace arbiter::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kReplacement = "\xEF\xBF\xBD";  // U+FFFD

std::string text_or_nothing(const json& value) {
  return value.is_null() ? std::string() : value.get<std::string>();
}

bool has_changed(const rules::FileText& file) {
  // What was not UTF-8 is not as it was read.
  if (file.content.find(kReplacement) != std::string::npos) return false;
  std::error_code error;
  const auto status = fs::status(file.path, error);
  if (status.type() == fs::file_type::not_found) return true;
  if (status.type() != fs::file_type::regular) return false;
  std::ifstream stream(file.path, std::ios::binary);
  if (!stream) return false;  // not allowed to read it
  const std::string now{std::istreambuf_iterator<char>(stream), {}};
  return !stream.bad() && now != file.content;
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
        past.at("until_ns").get<shm::Nanoseconds>()};
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
  return {{"generation", generation_},
          {"name", or_null(name_)},
          {"files", std::move(files)},
          {"application", texts_.application ? json(texts_.application->path) : json()},
          {"changed_files", changed_files()},
          {"in_force_since_ns", since_ == 0 ? json() : json(since_)},
          {"how", or_null(how_)},
          {"by", or_null(by_)},
          {"provenance_known", has_texts_}};
}

std::vector<std::string> ModelInForce::changed_files() const {
  std::vector<std::string> changed;
  for (const auto& file : texts_.models) {
    if (has_changed(file)) changed.push_back(file.path);
  }
  if (texts_.application && has_changed(*texts_.application)) {
    changed.push_back(texts_.application->path);
  }
  return changed;
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
