#include "wire/document.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

namespace arbiter::wire {

std::string read_document(const shm::FileDescriptor& descriptor) {
  struct stat file {};
  // Memory alone has seals.
  const bool is_memory = descriptor && fcntl(descriptor.get(), F_GET_SEALS) >= 0 &&
                         fstat(descriptor.get(), &file) == 0;
  if (!is_memory) throw DocumentError("the daemon sent no document");
  const auto size = static_cast<std::size_t>(file.st_size);
  if (size > kMaxDocument) {
    throw DocumentError("the daemon's document of " + std::to_string(size) +
                        " bytes is not read: it may have " + std::to_string(kMaxDocument));
  }
  std::string text(size, '\0');
  std::size_t at = 0;
  while (at < text.size()) {
    const ssize_t got =
        pread(descriptor.get(), text.data() + at, text.size() - at, static_cast<off_t>(at));
    if (got <= 0) throw DocumentError("the daemon's document cannot be read");
    at += static_cast<std::size_t>(got);
  }
  return text;
}

nlohmann::json parse_document(std::string_view text) {
  using Json = nlohmann::json;
  const auto judge = [](int depth, Json::parse_event_t event, Json& /*parsed*/) {
    const bool opens =
        event == Json::parse_event_t::object_start || event == Json::parse_event_t::array_start;
    if (opens && depth >= kMaxNesting) {
      throw DocumentError("the daemon's document is nested more than " +
                          std::to_string(kMaxNesting) + " deep");
    }
    return true;
  };
  try {
    return Json::parse(text, judge);
  } catch (const Json::exception& error) {
    throw DocumentError(std::string("the daemon's document is not JSON: ") + error.what());
  }
}

std::string write_document(const nlohmann::json& document) {
  return document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace arbiter::wire
