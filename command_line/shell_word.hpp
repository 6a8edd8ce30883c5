// Commands that are to be pasted into a shell.
#pragma once

#include <string>
#include <string_view>

namespace arbiter::command_line {

// As a shell reads it: bare where nothing in it has a meaning to any shell.
inline std::string shell_word(const std::string& text) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./:@%+=,-";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string word = "'";
  for (const char each : text) word += each == '\'' ? std::string(R"('\'')") : std::string(1, each);
  return word + "'";
}

}  // namespace arbiter::command_line
