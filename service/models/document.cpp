#include "service/models/document.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "shm/segment.hpp"
#include "wire/model_document.hpp"

namespace arbiter::service {
namespace {

std::optional<std::string> or_nothing(const std::string& text) {
  return text.empty() ? std::nullopt : std::optional(text);
}

std::map<std::string, std::vector<std::string>> connections_of(const rules::CompiledModel& model) {
  std::map<std::string, std::vector<std::string>> ports;
  for (const auto& port : model.ports) {
    auto& sources = ports[port.port];
    for (const auto& rule : port.rules) sources.push_back(rule.source);
  }
  return ports;
}

void add_origin(const ModelDocumentOf& of, wire::ModelDocument& document) {
  const std::string name = of.models.name();
  const PastModel* latest = of.history.find(of.models.in_force().generation);
  if (name != kDefaultModel) document.name = or_nothing(name);
  if (latest != nullptr) {
    document.how = latest->how;
    document.by = or_nothing(latest->by);
  }
  const auto& loaded = of.library.models();
  const auto is_it = [&](const LoadedModel& each) { return each.model == of.model; };
  if (of.model != nullptr) {
    document.as_loaded = std::any_of(loaded.begin(), loaded.end(), is_it);
  }
  document.in_force_since = of.models.in_force_since();
}

void add_texts(const ModelDocumentOf& of, wire::ModelDocument& document) {
  const auto* texts = of.model == nullptr ? nullptr : of.model->compiled.texts.get();
  document.known = texts != nullptr;
  document.directory = working_directory();
  if (texts == nullptr) return;
  for (const auto& file : texts->models) document.models.push_back({file.path, file.content});
  if (texts->application) {
    document.application = {texts->application->path, texts->application->content};
  }
}

std::string document_of(const ModelDocumentOf& of) {
  wire::ModelDocument document;
  document.generation = of.models.in_force().generation;
  add_origin(of, document);
  add_texts(of, document);
  for (const auto& [port, since] : of.continuity.ports()) document.ports_since[port] = since;
  for (const auto& [source, past] : of.continuity.timeouts()) {
    document.timeouts_before[source] = {past.timeout, past.until, past.word};
  }
  for (const LoadedModel& each : of.library.models()) {
    if (each.model == of.model) continue;
    document.others.push_back({each.model->name, connections_of(each.model->compiled)});
  }
  // Application files may be in Latin-1; JSON may not.
  return wire::write_model_document(document);
}

}  // namespace

std::string working_directory() {
  std::error_code error;
  return std::filesystem::current_path(error).string();
}

const shm::FileDescriptor& ModelDocument::of(const ModelDocumentOf& of) {
  const std::uint64_t generation = of.models.in_force().generation;
  if (generation_ == generation) return readable_;
  const std::string document = document_of(of);
  const auto file = shm::make_segment("arbiter-model", document.size());
  for (std::size_t at = 0; at < document.size();) {
    const ssize_t count =
        pwrite(file.get(), document.data() + at, document.size() - at, static_cast<off_t>(at));
    if (count <= 0) throw std::runtime_error("the model could not be copied");
    at += static_cast<std::size_t>(count);
  }
  shm::seal(file, shm::Seals::kOneWriter);  // many will read this very one
  readable_ = shm::reopen(file, O_RDONLY);
  generation_ = generation;
  return readable_;
}

}  // namespace arbiter::service
