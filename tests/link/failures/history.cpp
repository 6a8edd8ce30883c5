#include "tests/link/failures/history.hpp"

#include <algorithm>
#include <array>

namespace arbiter::failures {

std::uint64_t counted_in(const std::string& described) {
  constexpr std::array<const char*, 6> kCounts{" lost",
                                               " late",
                                               " before the port was open",
                                               " withheld though they were wanted",
                                               " unreadable",
                                               " without memory"};
  std::uint64_t sum = 0;
  for (const char* const count : kCounts) {
    const std::size_t end = described.find(count);
    if (end == std::string::npos) continue;
    sum += std::stoull(described.substr(described.rfind(' ', end - 1) + 1));
  }
  return sum;
}

bool is_there(const History& history, unsigned host, const Span& when) {
  const auto& lives = history.hosts[host - 1].rivals;
  return std::any_of(lives.begin(), lives.end(), [&](const RivalLife& life) {
    return life.span.from <= when.from && life.end() > when.to;
  });
}

bool History::is_quiet(unsigned one, unsigned other, const Span& when, Of what) const {
  return std::none_of(troubled.begin(), troubled.end(), [&](const Troubled& each) {
    const bool is_of_them = each.host == 0 || each.host == one || each.host == other;
    const bool counts =
        is_of_processes(each.trouble) || (what == Of::anything && is_of_frames(each.trouble));
    return is_of_them && counts && each.span.from < when.to && when.from < each.span.to;
  });
}

}  // namespace arbiter::failures
