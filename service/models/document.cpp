#include "service/models/document.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>

#include <nlohmann/json.hpp>

#include "shm/segment.hpp"

namespace arbiter::service {
namespace {

using nlohmann::json;

json file_json(const rules::FileText& file) {
  return {{"path", file.path}, {"text", file.content}};
}

json timeout_json(shm::Nanoseconds timeout) {
  return timeout == shm::kForever ? json("forever") : json(timeout);
}

json connections_json(const rules::CompiledModel& model) {
  json ports = json::object();
  for (const auto& port : model.ports) {
    json& sources = ports[port.port] = json::array();
    for (const auto& rule : port.rules) sources.push_back(rule.source);
  }
  return ports;
}

void add_origin(const ModelDocumentOf& of, json& document) {
  const std::string name = of.models.name();
  const PastModel* latest = of.history.find(of.models.in_force().generation);
  const bool is_named = !name.empty() && name != kDefaultModel;
  document["name"] = is_named ? json(name) : json(nullptr);
  document["how"] = latest == nullptr ? json(nullptr) : json(latest->how);
  const auto& loaded = of.library.models();
  const auto is_it = [&](const LoadedModel& each) { return each.model == of.model; };
  document["as_loaded"] =
      of.model == nullptr ? json(nullptr) : json(std::any_of(loaded.begin(), loaded.end(), is_it));
  document["by"] = latest == nullptr || latest->by.empty() ? json(nullptr) : json(latest->by);
  document["in_force_since_ns"] = of.models.in_force_since();
}

void add_texts(const ModelDocumentOf& of, json& document) {
  const auto* texts = of.model == nullptr ? nullptr : of.model->compiled.texts.get();
  document["known"] = texts != nullptr;
  document["directory"] = working_directory();
  document["models"] = json::array();
  document["application"] = nullptr;
  if (texts == nullptr) return;
  for (const auto& file : texts->models) document["models"].push_back(file_json(file));
  if (texts->application) document["application"] = file_json(*texts->application);
}

void add_past(const ModelDocumentOf& of, json& document) {
  document["ports_since_ns"] = json::object();
  for (const auto& [port, since] : of.continuity.ports()) document["ports_since_ns"][port] = since;
  document["timeouts_before"] = json::object();
  for (const auto& [source, past] : of.continuity.timeouts()) {
    document["timeouts_before"][source] = {
        {"timeout_ns", timeout_json(past.timeout)}, {"until_ns", past.until}, {"word", past.word}};
  }
}

std::string document_of(const ModelDocumentOf& of) {
  json document = {{"generation", of.models.in_force().generation}, {"others", json::array()}};
  add_origin(of, document);
  add_texts(of, document);
  add_past(of, document);
  for (const LoadedModel& each : of.library.models()) {
    if (each.model == of.model) continue;
    document["others"].push_back(
        {{"name", each.model->name}, {"ports", connections_json(each.model->compiled)}});
  }
  // Application files may be in Latin-1; JSON may not.
  return document.dump(-1, ' ', false, json::error_handler_t::replace);
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
