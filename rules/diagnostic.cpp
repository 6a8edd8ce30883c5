#include "rules/diagnostic.hpp"

#include <algorithm>

namespace arbiter::rules {
namespace {

bool is_control(char byte) { return static_cast<unsigned char>(byte) < 0x20 || byte == '\x7f'; }

// A message cites what stands in a file. Nothing of it may begin a line of its own, which would
// look like another finding, or have a meaning to a terminal.
std::string in_one_line(std::string text) {
  if (std::none_of(text.begin(), text.end(), is_control)) return text;
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string result;
  for (const char byte : text) {
    if (!is_control(byte)) {
      result += byte;
    } else if (byte == '\n') {
      result += "\\n";
    } else {
      result += {'\\', 'x', kDigits[byte >> 4 & 15], kDigits[byte & 15]};
    }
  }
  return result;
}

}  // namespace

void Diagnostics::silence(const std::vector<std::string>& codes) {
  std::erase_if(items_, [&](const Diagnostic& item) {
    return item.severity != Severity::kError &&
           std::find(codes.begin(), codes.end(), item.code) != codes.end();
  });
}

void Diagnostics::add(Severity severity, std::string code, Location where, std::string message,
                      std::optional<Witness> witness, std::vector<Witness> more_witnesses) {
  if (items_.size() == kMaxItems) {
    ++dropped_;
    return;
  }
  items_.push_back({severity, std::move(code), std::move(where), in_one_line(std::move(message)),
                    std::move(witness), std::move(more_witnesses)});
}

}  // namespace arbiter::rules
