#include "service/model_copy.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <stdexcept>
#include <string>

#include <nlohmann/json.hpp>

#include "shm/segment.hpp"

namespace arbiter::service {
namespace {

using nlohmann::json;

json file_json(const rules::FileText& file) {
  return {{"path", file.path}, {"text", file.content}};
}

std::string document_of(const Models& models, std::uint64_t generation,
                        const rules::ModelTexts* texts) {
  json document = {{"generation", generation},
                   {"in_force_since_ns", models.in_force_since()},
                   {"known", texts != nullptr},
                   {"models", json::array()},
                   {"application", nullptr}};
  if (texts != nullptr) {
    for (const auto& file : texts->models) document["models"].push_back(file_json(file));
    if (texts->application) document["application"] = file_json(*texts->application);
  }
  // Application files may be in Latin-1; JSON may not.
  return document.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace

const shm::FileDescriptor& ModelCopy::of(const Models& models, const rules::ModelTexts* texts) {
  const std::uint64_t generation = models.in_force().generation;
  if (generation_ == generation) return readable_;
  const std::string document = document_of(models, generation, texts);
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
