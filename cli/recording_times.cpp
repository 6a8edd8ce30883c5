#include "cli/recording_times.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <ctime>
#include <limits>
#include <optional>

#include <CLI/CLI.hpp>

#include "rules/text/names.hpp"

namespace arbiter::cli {
namespace {

using evidence::Recorded;
using evidence::TimeSpan;

constexpr shm::Nanoseconds kWholeSecond = 1'000'000'000;

shm::Nanoseconds first_arrival(const Recorded& recorded) {
  for (const auto& run : recorded.runs) {
    if (!run.decisions.empty()) return run.decisions.front().arrival().time;
  }
  return recorded.runs.front().start;
}

// "1.500000000 s", to the nanosecond.
std::string exact_seconds(shm::Nanoseconds span) {
  char text[64];
  std::snprintf(text, sizeof text, "%lld.%09lld s", static_cast<long long>(span / 1'000'000'000),
                static_cast<long long>(span % 1'000'000'000));
  return text;
}

[[noreturn]] void refuse(const std::string& option, const std::string& text,
                         const std::string& why) {
  throw CLI::ValidationError(option, rules::quote(text) + ' ' + why);
}

// Of a second, in nanoseconds: ".25", or nothing.
std::optional<shm::Nanoseconds> fraction_of(const char* rest) {
  if (*rest == '\0') return 0;
  const std::string digits = *rest == '.' ? rest + 1 : "";
  if (digits.empty() || digits.size() > 9 ||
      digits.find_first_not_of("0123456789") != std::string::npos) {
    return std::nullopt;
  }
  return std::stoll(digits + std::string(9 - digits.size(), '0'));
}

// That time of a day: the first in the recording, or else the nearest to it, which may be of the
// day before or behind.
std::time_t in_or_beside(const std::tm& time, std::time_t begin, std::time_t end) {
  std::time_t nearest = 0;
  std::time_t least = std::numeric_limits<std::time_t>::max();
  for (const int day : {-1, 0, 1}) {
    std::tm parts = time;
    parts.tm_mday += day;
    const std::time_t second = std::mktime(&parts);
    const std::time_t distance =
        second + 1 <= begin ? begin - second : std::max(second - end, std::time_t{0});
    if (distance >= least) continue;
    nearest = second;
    least = distance;
  }
  return nearest;
}

}  // namespace

std::string since_first(const Recorded& recorded, shm::Nanoseconds time) {
  const shm::Nanoseconds span = time - first_arrival(recorded);
  return span < 0 ? exact_seconds(-span) + " before the first arrival" : "+" + exact_seconds(span);
}

std::string wall_text(const Recorded& recorded, shm::Nanoseconds time) {
  const std::time_t seconds = (time + recorded.about.wall_offset) / 1'000'000'000;
  std::tm parts{};
  localtime_r(&seconds, &parts);
  char text[64];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S %Z", &parts);
  return text;
}

RecordedTime time_of(const Recorded& recorded) {
  return {recorded.runs.front().start, recorded.runs.back().end, recorded.about.wall_offset};
}

TimeSpan read_time(const std::string& option, const std::string& text,
                   const RecordedTime& recorded) {
  const shm::Nanoseconds wall_offset = recorded.wall_offset;
  const std::time_t begin = (recorded.begin + wall_offset) / kWholeSecond;
  const std::time_t end = (recorded.end + wall_offset) / kWholeSecond;
  for (const char* format : {"%Y-%m-%d %H:%M:%S", "%Y-%m-%dT%H:%M:%S", "%H:%M:%S"}) {
    std::tm parts{};
    localtime_r(&begin, &parts);
    const char* const rest = strptime(text.c_str(), format, &parts);
    const auto fraction = rest == nullptr ? std::nullopt : fraction_of(rest);
    if (!fraction) continue;
    parts.tm_isdst = -1;
    std::time_t second = std::mktime(&parts);
    if (format[1] == 'H') second = in_or_beside(parts, begin, end);
    // No year is too far away to be counted in nanoseconds.
    second = std::clamp(second, begin - 10, end + 10);
    const shm::Nanoseconds from = second * kWholeSecond + *fraction - wall_offset;
    return {from, from + (*rest == '\0' ? kWholeSecond : 1)};
  }
  refuse(option, text, "is not a time: write 14:03:07, 14:03:07.250 or 2026-11-22 14:03:07");
}

void require_within(const std::string& option, const std::string& text, const TimeSpan& span,
                    const RecordedTime& recorded) {
  if (span.to > recorded.begin && span.from <= recorded.end) return;
  refuse(option, text,
         "is not in the recording, which is from " +
             clock_text(recorded.begin + recorded.wall_offset) + " to " +
             clock_text(recorded.end + recorded.wall_offset));
}

TimeSpan read_moment(const std::string& text, const RecordedTime& recorded) {
  const TimeSpan span = read_time("--at", text, recorded);
  require_within("--at", text, span, recorded);
  return span;
}

std::string clock_text(shm::Nanoseconds wall) {
  const std::time_t seconds = wall / 1'000'000'000;
  std::tm parts{};
  localtime_r(&seconds, &parts);
  char text[64];
  const std::size_t length = std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S", &parts);
  std::snprintf(text + length, sizeof text - length, ".%03d",
                static_cast<int>(wall / 1'000'000 % 1000));
  return text;
}

}  // namespace arbiter::cli
