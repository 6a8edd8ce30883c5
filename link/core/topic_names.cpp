#include "link/core/topic_names.hpp"

namespace arbiter::link {

std::string topic_of_source(std::string_view source) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string topic = "arbiter/source";
  for (const char c : source) {
    const bool is_plain =
        (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '/';
    if (is_plain) {
      topic += c;
      continue;
    }
    const auto byte = static_cast<unsigned char>(c);
    topic += '_';
    topic += kDigits[byte >> 4U];
    topic += kDigits[byte & 15U];
  }
  return topic;
}

}  // namespace arbiter::link
