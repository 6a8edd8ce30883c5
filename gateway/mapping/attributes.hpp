// The attributes of one element of a mapping, read as what they are. What is wrong is reported
// once, with its place; what is returned then is as if the attribute were absent.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gateway/mapping/mapping.hpp"
#include "rules/model/element_reader.hpp"

namespace arbiter::gateway {

// "1 byte", "48 bytes".
[[nodiscard]] inline std::string bytes_text(std::size_t count) {
  return std::to_string(count) + (count == 1 ? " byte" : " bytes");
}

class Attributes {
 public:
  Attributes(rules::ElementReader& reader, const rules::XmlNode& element)
      : reader_(reader), element_(element) {}

  [[nodiscard]] bool has(std::string_view name) const {
    return rules::ElementReader::has_attribute(element_, name);
  }
  // Trimmed, not empty, at most `max` bytes.
  std::optional<std::string> text(std::string_view name, std::size_t max);
  // The same of one that must be there.
  std::string required(std::string_view name, std::size_t max);
  std::optional<Port> port(std::string_view name);
  std::optional<std::uint64_t> number(std::string_view name, std::uint64_t least,
                                      std::uint64_t most);
  // "4096", "64KiB", "1MiB".
  std::optional<std::uint64_t> bytes(std::string_view name, std::uint64_t least,
                                     std::uint64_t most);
  std::optional<long double> real(std::string_view name);
  // Not forever.
  std::optional<shm::Nanoseconds> duration(std::string_view name);
  // Several, separated by commas; none is empty.
  std::vector<std::string> list(std::string_view name, std::size_t max_each);
  std::optional<bool> boolean(std::string_view name);

  // One of a few words.
  template <class Value>
  std::optional<Value> word(std::string_view name,
                            std::initializer_list<std::pair<std::string_view, Value>> known) {
    const auto found = value(name);
    if (!found) return {};
    std::vector<std::string_view> words;
    for (const auto& [each, meaning] : known) {
      if (each == found->text) return meaning;
      words.push_back(each);
    }
    refuse_word(name, *found, words);
    return {};
  }

  // Where the attribute's value stands; where the element does if it is absent.
  [[nodiscard]] rules::Location where(std::string_view name) const;
  void error(std::string code, std::string_view at_attribute, std::string message);

 private:
  struct Value {
    std::string text;  // trimmed
    rules::Location where;
  };
  std::optional<Value> value(std::string_view name);
  void refuse(const Value& value, std::string_view name, const std::string& what_it_takes);
  void refuse_word(std::string_view name, const Value& value,
                   const std::vector<std::string_view>& known);
  std::optional<std::uint64_t> whole(std::string_view name, std::uint64_t least, std::uint64_t most,
                                     bool with_units);

  rules::ElementReader& reader_;
  const rules::XmlNode& element_;
};

}  // namespace arbiter::gateway
