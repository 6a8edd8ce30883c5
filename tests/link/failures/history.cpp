#include "tests/link/failures/history.hpp"

#include <algorithm>
#include <array>

namespace arbiter::failures {
namespace {

// What stands before `what`, which ends at a comma or with the text.
std::uint64_t count_of(const std::string& described, const std::string& what) {
  const std::size_t end = (described + ',').find(what + ',');
  if (end == std::string::npos) return 0;
  return std::stoull(described.substr(described.rfind(' ', end - 1) + 1));
}

}  // namespace

std::uint64_t counted_in(const std::string& described) {
  constexpr std::array<const char*, 6> kCounts{" lost",
                                               " late",
                                               " before the port was open",
                                               " withheld though they were wanted",
                                               " unreadable",
                                               " without memory"};
  std::uint64_t sum = 0;
  for (const char* const count : kCounts) sum += count_of(described, count);
  return sum;
}

std::uint64_t withheld_in(const std::string& described) { return count_of(described, " withheld"); }

bool is_there(const History& history, unsigned host, const Span& when) {
  const auto& lives = history.hosts[host - 1].rivals;
  return std::any_of(lives.begin(), lives.end(), [&](const RivalLife& life) {
    return life.span.from <= when.from && life.end() > when.to;
  });
}

std::uint64_t History::troubles_of(unsigned one, unsigned other, Nanoseconds since) const {
  return static_cast<std::uint64_t>(
      std::count_if(troubled.begin(), troubled.end(), [&](const Troubled& each) {
        const bool is_of_them = each.host == 0 || each.host == one || each.host == other;
        return is_of_them && each.trouble != Trouble::rival && each.span.to > since;
      }));
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
