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
  const auto is_silenced = [&](Severity severity, const std::string& code) {
    return severity != Severity::kError &&
           std::find(codes.begin(), codes.end(), code) != codes.end();
  };
  std::erase_if(items_,
                [&](const Diagnostic& item) { return is_silenced(item.severity, item.code); });
  std::erase_if(tallies_, [&](const auto& tally) {
    return is_silenced(tally.first.first, tally.first.second);
  });
}

void Diagnostics::add(Diagnostics other) {
  for (Diagnostic& item : other.items_) add(std::move(item));
  for (const Omission& omission : other.omissions()) {
    tallies_[{omission.severity, omission.code}].found += omission.count;
  }
}

std::vector<Omission> Diagnostics::omissions() const {
  std::vector<Omission> result;
  for (const auto& [kind, tally] : tallies_) {
    if (tally.found <= kMaxOfCode) continue;
    result.push_back({kind.first, kind.second, tally.last_kept, tally.found - kMaxOfCode});
  }
  return result;
}

std::size_t Diagnostics::count(Severity severity) const {
  std::size_t count = 0;
  for (const auto& [kind, tally] : tallies_) {
    if (kind.first == severity) count += tally.found;
  }
  return count;
}

std::size_t Diagnostics::count(Severity severity, const std::string& code) const {
  const auto found = tallies_.find({severity, code});
  return found == tallies_.end() ? 0 : found->second.found;
}

void Diagnostics::find(Diagnostic item) {
  item.message = in_one_line(std::move(item.message));
  add(std::move(item));
}

void Diagnostics::add(Diagnostic item) {
  if (item.severity == Severity::kError) has_errors_ = true;
  Tally& tally = tallies_[{item.severity, item.code}];
  if (++tally.found > kMaxOfCode) return;
  tally.last_kept = item.where;
  items_.push_back(std::move(item));
}

}  // namespace arbiter::rules
