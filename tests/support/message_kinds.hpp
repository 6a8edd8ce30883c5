// The kinds of messages by name, as the header has them.
#pragma once

#include <cstdint>
#include <map>
#include <regex>
#include <stdexcept>
#include <string>

#include "tests/support/text_files.hpp"
#include "wire/messages.hpp"

namespace arbiter::test {

using Numbers = std::map<std::string, std::uint32_t>;

inline std::string source_of(const std::string& path) {
  return content_of(std::string(ARBITER_SOURCE) + "/" + path);
}

// The enumerators of an enumeration in the text of a header, comments left out.
inline Numbers enumerators(const std::string& header, const std::string& name) {
  const auto begin = header.find("enum " + name);
  if (begin == std::string::npos) throw std::runtime_error("no enum " + name);
  std::string body = header.substr(begin, header.find("};", begin) - begin);
  body = std::regex_replace(body.substr(body.find('{')), std::regex("//[^\n]*"), "") + ",";
  const std::regex enumerator("(k[A-Za-z0-9]+)( = ([0-9]+))?\\s*,");
  Numbers numbers;
  std::uint32_t next = 0;
  for (std::sregex_iterator found(body.begin(), body.end(), enumerator), end; found != end;
       ++found) {
    if ((*found)[3].matched) next = static_cast<std::uint32_t>(std::stoul((*found)[3]));
    numbers[(*found)[1]] = next++;
  }
  return numbers;
}
inline Numbers kinds_of_header() {
  return enumerators(source_of("wire/messages.hpp"), "class MessageKind");
}

inline std::string name_of(wire::MessageKind kind) {
  static const Numbers kinds = kinds_of_header();
  for (const auto& [name, number] : kinds) {
    if (number == static_cast<std::uint32_t>(kind)) return name;
  }
  return "unknown";
}

}  // namespace arbiter::test
