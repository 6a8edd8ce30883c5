#include "cli/recording_times.hpp"

#include <cstddef>
#include <cstdio>
#include <ctime>

namespace arbiter::cli {
namespace {

using evidence::Recorded;

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

}  // namespace

std::string since_first(const Recorded& recorded, shm::Nanoseconds time) {
  const shm::Nanoseconds span = time - first_arrival(recorded);
  return span < 0 ? exact_seconds(-span) + " before the first arrival" : "+" + exact_seconds(span);
}

std::string wall_text(const Recorded& recorded, shm::Nanoseconds time) {
  const std::time_t seconds = (time + recorded.about.wall_offset) / 1'000'000'000;
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[64];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S UTC", &parts);
  return text;
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
