#include "service/kept/model_name.hpp"

#include <algorithm>

namespace arbiter::service {
namespace {

bool is_name_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
         c == '.' || c == '-';
}

}  // namespace

bool is_model_name(std::string_view text) {
  return !text.empty() && text.size() <= kMaxModelName && text.front() != '-' &&
         std::all_of(text.begin(), text.end(), is_name_character);
}

}  // namespace arbiter::service
