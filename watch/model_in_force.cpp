#include "watch/model_in_force.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <ios>
#include <system_error>
#include <utility>

#include "watch/instance.hpp"
#include "wire/document.hpp"

namespace arbiter::watch {
namespace {

namespace fs = std::filesystem;

constexpr const char* kReplacement = "\xEF\xBF\xBD";  // U+FFFD

FileNow::State state_of(const rules::FileText& file) {
  std::error_code error;
  const auto status = fs::status(file.path, error);
  if (status.type() == fs::file_type::not_found) return FileNow::State::kGone;
  if (status.type() != fs::file_type::regular) return FileNow::State::kUnreadable;
  std::ifstream stream(file.path, std::ios::binary);
  std::string now(file.content.size() + 1, '\0');  // one more, for it may have grown
  stream.read(now.data(), static_cast<std::streamsize>(now.size()));
  if (!stream.is_open() || stream.bad()) return FileNow::State::kUnreadable;
  now.resize(static_cast<std::size_t>(stream.gcount()));
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

ModelInForce::ModelInForce(wire::ModelDocument document) : document_(std::move(document)) {
  const auto take = [this](wire::ModelFile& file) {
    return rules::FileText{path_from_here(file.path, document_.directory), std::move(file.text)};
  };
  for (wire::ModelFile& file : document_.models) texts_.models.push_back(take(file));
  if (document_.application) texts_.application = take(*document_.application);
  document_.models.clear();
  document_.application.reset();
}

ModelInForce ModelInForce::fetch(Instance& instance) {
  wire::Message question;
  question.kind = wire::MessageKind::kModel;
  const wire::Received answer = instance.ask(question);
  return ModelInForce(wire::read_model_document(wire::read_document(answer.descriptors[0])));
}

shm::Nanoseconds ModelInForce::since(const std::string& port) const {
  const auto found = document_.ports_since.find(port);
  return found == document_.ports_since.end() ? since() : found->second;
}

std::optional<wire::PastTimeout> ModelInForce::timeout_before(const std::string& source) const {
  const auto found = document_.timeouts_before.find(source);
  return found == document_.timeouts_before.end() ? std::nullopt : std::optional(found->second);
}

std::string ModelInForce::text() const {
  if (is_none()) return "no model";
  std::string text = "model " + std::to_string(generation());
  if (name()) text += " \"" + *name() + '"';
  if (texts_.models.empty()) return text;
  text += " (" + texts_.models.front().path;
  if (const auto more = texts_.models.size() - 1; more != 0) {
    text += " and " + std::to_string(more) + " more";
  }
  return text + ')';
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
  for (const wire::OtherModel& model : document_.others) {
    const auto found = model.ports.find(port);
    if (found == model.ports.end()) continue;
    const auto& sources = found->second;
    if (!source || std::find(sources.begin(), sources.end(), *source) != sources.end()) {
      return model.name;
    }
  }
  return std::nullopt;
}

}  // namespace arbiter::watch
