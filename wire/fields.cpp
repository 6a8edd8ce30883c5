#include "wire/fields.hpp"

#include <algorithm>

namespace arbiter::wire {

FieldReader::FieldReader(const Json& object, std::string path)
    : object_(object), path_(std::move(path)) {
  if (!object.is_object()) refuse_type(path_, object, "an object");
}

const nlohmann::json* FieldReader::find(const char* key) const {
  const auto found = object_.find(key);
  return found == object_.end() ? nullptr : &*found;
}

const nlohmann::json& FieldReader::at(const char* key) const {
  const Json* const found = find(key);
  if (found == nullptr) refuse(path_of(key), "is missing");
  return *found;
}

std::string FieldReader::path_of(const char* key) const {
  return path_.empty() ? std::string(key) : path_ + '.' + key;
}

std::size_t FieldReader::index_of(const char* key, std::span<const char* const> names) const {
  std::string name;
  read(at(key), path_of(key), name);
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) refuse(path_of(key), "is \"" + name + "\", which is not known here");
  return static_cast<std::size_t>(found - names.begin());
}

void FieldReader::span(const char* key, shm::Nanoseconds& value) {
  const Json& found = at(key);
  if (found == "forever") {
    value = shm::kForever;
  } else {
    read(found, path_of(key), value);
  }
}

void FieldReader::refuse(const std::string& path, const std::string& what) {
  throw DocumentError(
      (path.empty() ? "the daemon's document " : "the daemon's document: " + path + ' ') + what +
      "; are this program and arbiterd of the same version?");
}

void FieldReader::refuse_type(const std::string& path, const Json& found, const char* wanted) {
  refuse(path, std::string("is ") + found.type_name() + ", and must be " + wanted);
}

void FieldReader::read(const Json& from, const std::string& path, bool& value) {
  if (!from.is_boolean()) refuse_type(path, from, "a boolean");
  value = from.get<bool>();
}

void FieldReader::read(const Json& from, const std::string& path, std::string& value) {
  if (!from.is_string()) refuse_type(path, from, "a string");
  value = from.get_ref<const std::string&>();
}

}  // namespace arbiter::wire
