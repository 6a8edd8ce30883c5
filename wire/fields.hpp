// One list of fields for both directions: how a struct becomes a JSON object, and how it is read.
//
// Each struct has a function that names its fields once:
//
//   void describe(auto& field, Is<Component> auto& of) {
//     field("node", of.node);
//     field.counter("published", of.published);
//   }
//
// FieldWriter and FieldReader are the two things that `field` can be. What is read is judged:
//
//   field(key, member)          A field that is missing, or of another type, or a number that does
//                               not fit, is a DocumentError that names it. An empty optional is
//                               null. Structs, vectors and maps by name are read into.
//   field.counter(key, member)  The same, but 0 where it is missing: a program and a daemon of two
//                               versions may differ in what they count.
//   field.list(key, vector)     The same, but empty where it is missing.
//   field.maybe(key, optional)  Missing where it is empty.
//   field.beside(key, optional) `key` is a boolean; where it is true, the fields of the struct
//                               stand beside it.
//   field.has(key, optional)    `key` says whether the optional has a value; it is written only.
//   field.span(key, span)       Nanoseconds, or the string "forever".
//   field.choice(key, member, names)  An enumeration that counts from 0, by its names.
//
// Fields that nobody has named are passed over: a later version may add some.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "shm/activity.hpp"
#include "wire/document.hpp"

namespace arbiter::wire {

template <class T, class Of>
concept Is = std::same_as<std::remove_const_t<T>, Of>;

class FieldWriter {
 public:
  template <class T>
  static nlohmann::json json_of(const T& value) {
    if constexpr (std::is_arithmetic_v<T> || std::same_as<T, std::string>) {
      return value;
    } else {
      FieldWriter writer;
      describe(writer, value);
      return std::move(writer.object_);
    }
  }
  template <class T>
  static nlohmann::json json_of(const std::optional<T>& value) {
    return value ? json_of(*value) : nlohmann::json(nullptr);
  }
  template <class T>
  static nlohmann::json json_of(const std::vector<T>& values) {
    auto result = nlohmann::json::array();
    for (const T& value : values) result.push_back(json_of(value));
    return result;
  }
  template <class T>
  static nlohmann::json json_of(const std::map<std::string, T>& values) {
    auto result = nlohmann::json::object();
    for (const auto& [name, value] : values) result[name] = json_of(value);
    return result;
  }

  template <class T>
  void operator()(const char* key, const T& value) {
    object_[key] = json_of(value);
  }
  void counter(const char* key, std::uint64_t value) { object_[key] = value; }
  template <class T>
  void list(const char* key, const std::vector<T>& values) {
    object_[key] = json_of(values);
  }
  template <class T>
  void maybe(const char* key, const std::optional<T>& value) {
    if (value) object_[key] = json_of(*value);
  }
  template <class T>
  void beside(const char* key, const std::optional<T>& value) {
    object_[key] = value.has_value();
    if (value) describe(*this, *value);
  }
  template <class T>
  void has(const char* key, const std::optional<T>& value) {
    object_[key] = value.has_value();
  }
  void span(const char* key, shm::Nanoseconds value) {
    object_[key] = value == shm::kForever ? nlohmann::json("forever") : nlohmann::json(value);
  }
  template <class T>
  void choice(const char* key, T value, std::span<const char* const> names) {
    object_[key] = names[static_cast<std::size_t>(value)];
  }

 private:
  nlohmann::json object_ = nlohmann::json::object();
};

class FieldReader {
 public:
  // A whole document. Throws DocumentError.
  template <class T>
  static T read_whole(std::string_view text) {
    const nlohmann::json document = parse_document(text);
    T value;
    FieldReader reader(document, {});
    describe(reader, value);
    return value;
  }

  // Keeps references. `path`: where the object stands in the document; empty: it is the document.
  FieldReader(const nlohmann::json& object, std::string path);

  template <class T>
  void operator()(const char* key, T& value) {
    read(at(key), path_of(key), value);
  }
  void counter(const char* key, std::uint64_t& value) {
    if (const auto* found = find(key)) read(*found, path_of(key), value);
  }
  template <class T>
  void list(const char* key, std::vector<T>& values) {
    if (const auto* found = find(key)) read(*found, path_of(key), values);
  }
  template <class T>
  void maybe(const char* key, std::optional<T>& value) {
    if (const auto* found = find(key)) read(*found, path_of(key), value);
  }
  template <class T>
  void beside(const char* key, std::optional<T>& value) {
    bool is_there = false;
    (*this)(key, is_there);
    if (is_there) describe(*this, value.emplace());
  }
  template <class T>
  void has(const char* /*key*/, const std::optional<T>& /*value*/) {}
  void span(const char* key, shm::Nanoseconds& value);
  template <class T>
  void choice(const char* key, T& value, std::span<const char* const> names) {
    value = static_cast<T>(index_of(key, names));
  }

  // For what a field must be besides. `what`: "is …".
  [[noreturn]] void refuse(const char* key, const std::string& what) const {
    refuse(path_of(key), what);
  }

 private:
  using Json = nlohmann::json;

  // Null: it is not there.
  [[nodiscard]] const Json* find(const char* key) const;
  [[nodiscard]] const Json& at(const char* key) const;
  [[nodiscard]] std::string path_of(const char* key) const;
  [[nodiscard]] std::size_t index_of(const char* key, std::span<const char* const> names) const;
  [[noreturn]] static void refuse(const std::string& path, const std::string& what);
  [[noreturn]] static void refuse_type(const std::string& path, const Json& found,
                                       const char* wanted);

  static void read(const Json& from, const std::string& path, bool& value);
  static void read(const Json& from, const std::string& path, std::string& value);
  template <std::integral T>
  static void read(const Json& from, const std::string& path, T& value) {
    if (!from.is_number_integer()) refuse_type(path, from, "an integer");
    const bool fits = from.is_number_unsigned() ? std::in_range<T>(from.get<std::uint64_t>())
                                                : std::in_range<T>(from.get<std::int64_t>());
    if (!fits) refuse(path, "is " + from.dump() + ", which is out of range");
    value = from.get<T>();
  }
  template <class T>
  static void read(const Json& from, const std::string& path, std::optional<T>& value) {
    if (from.is_null()) {
      value.reset();
    } else {
      read(from, path, value.emplace());
    }
  }
  template <class T>
  static void read(const Json& from, const std::string& path, std::vector<T>& values) {
    if (!from.is_array()) refuse_type(path, from, "an array");
    values.clear();
    for (const Json& each : from) {
      const std::string place = path + '[' + std::to_string(values.size()) + ']';
      read(each, place, values.emplace_back());
    }
  }
  template <class T>
  static void read(const Json& from, const std::string& path, std::map<std::string, T>& values) {
    if (!from.is_object()) refuse_type(path, from, "an object");
    values.clear();
    for (const auto& [name, each] : from.items()) {
      std::string place = path;
      place.append(1, '.').append(name);
      read(each, place, values[name]);
    }
  }
  template <class T>
  requires std::is_class_v<T>
  static void read(const Json& from, const std::string& path, T& value) {
    FieldReader reader(from, path);
    describe(reader, value);
  }

  const Json& object_;
  const std::string path_;
};

}  // namespace arbiter::wire
