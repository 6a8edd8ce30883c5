#include "gateway/mapping/partitions.hpp"

#include <algorithm>
#include <string_view>

namespace arbiter::gateway {
namespace {

bool is_pattern(std::string_view name) { return name.find_first_of("*?") != name.npos; }

// `*`: any characters; `?`: any one; the name has neither. Without recursion: the pattern is a
// stranger's.
bool fits(std::string_view pattern, std::string_view name) {
  std::size_t p = 0;
  std::size_t n = 0;
  std::size_t star = pattern.npos;
  std::size_t resume = 0;
  while (n < name.size()) {
    if (p < pattern.size() && (pattern[p] == '?' || pattern[p] == name[n])) {
      ++p;
      ++n;
    } else if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      resume = n;
    } else if (star != pattern.npos) {
      p = star + 1;
      n = ++resume;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

bool fits_either(const std::string& a, const std::string& b, std::size_t& patience) {
  const bool is_a_pattern = is_pattern(a);
  const bool is_b_pattern = is_pattern(b);
  const std::size_t cost =
      1 + a.size() + b.size() + (is_a_pattern != is_b_pattern ? a.size() * b.size() : 0);
  if (patience <= cost) {
    patience = 0;
    return true;
  }
  patience -= cost;
  if (is_a_pattern) return !is_b_pattern && fits(a, b);
  return is_b_pattern ? fits(b, a) : a == b;
}

}  // namespace

bool share_partition(const std::vector<std::string>& a, const std::vector<std::string>& b,
                     std::size_t& patience) {
  static const std::vector<std::string> default_partition = {""};
  const auto& ours = a.empty() ? default_partition : a;
  const auto& theirs = b.empty() ? default_partition : b;
  return std::any_of(ours.begin(), ours.end(), [&](const std::string& one) {
    return std::any_of(theirs.begin(), theirs.end(),
                       [&](const std::string& other) { return fits_either(one, other, patience); });
  });
}

}  // namespace arbiter::gateway
