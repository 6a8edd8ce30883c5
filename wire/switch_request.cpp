#include "wire/switch_request.hpp"

#include <algorithm>
#include <charconv>

#include "shm/limits.hpp"
#include "wire/fields.hpp"

namespace arbiter::wire {
namespace {

constexpr std::size_t kDigits = 16;

// Names without what could end a line or do worse to one.
bool is_plain_name(std::string_view text) {
  return !text.empty() && text.size() <= shm::kMaxNameLength &&
         std::all_of(text.begin(), text.end(), [](char each) { return each > ' ' && each <= '~'; });
}

std::string_view take_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return line;
}

}  // namespace

std::string write_switch_request(const SwitchRequest& request) {
  static constexpr char kHexadecimal[] = "0123456789abcdef";
  std::string text;
  for (unsigned shift = 64; shift != 0; shift -= 4) {
    text += kHexadecimal[request.attempt >> (shift - 4) & 15];
  }
  text += '\n' + request.model;
  for (const std::string& host : request.without) text += '\n' + host;
  return text;
}

std::optional<SwitchRequest> read_switch_request(std::string_view text) {
  if (text.size() > kMaxSwitchRequest) return std::nullopt;
  SwitchRequest request;
  const std::string_view number = take_line(text);
  const auto read =
      std::from_chars(number.data(), number.data() + number.size(), request.attempt, 16);
  if (number.size() != kDigits || read.ec != std::errc() ||
      read.ptr != number.data() + number.size() || request.attempt == 0) {
    return std::nullopt;
  }
  request.model = take_line(text);
  if (!is_plain_name(request.model)) return std::nullopt;
  while (!text.empty()) {
    const std::string_view host = take_line(text);
    if (!is_plain_name(host) || request.without.size() == kMaxHostsLeftOut) return std::nullopt;
    request.without.emplace_back(host);
  }
  return request;
}

void describe(auto& field, Is<SwitchAnswer> auto& of) {
  field("generation", of.generation);
  field("model", of.model);
  field("unknown", of.unknown);
  field("left_out", of.is_left_out);
}

std::string write_switch_answer(const SwitchAnswer& answer) {
  return write_document(FieldWriter::json_of(answer));
}

SwitchAnswer read_switch_answer(std::string_view text) {
  return FieldReader::read_whole<SwitchAnswer>(text);
}

}  // namespace arbiter::wire
