#include "rules/text/duration.hpp"

#include <array>
#include <utility>

#include "rules/text/names.hpp"

namespace arbiter::rules {
namespace {

constexpr std::array<std::pair<std::string_view, shm::Nanoseconds>, 4> kUnits{
    {{"ns", 1}, {"us", 1'000}, {"ms", 1'000'000}, {"s", 1'000'000'000}}};

}  // namespace

ParsedDuration parse_duration(std::string_view text, const DurationWords& words) {
  const auto refuse = [&](const std::string& why, std::string_view advice) {
    return ParsedDuration{
        0, std::string(words.subject) + quote(text) + " " + why + "; " + std::string(advice)};
  };
  if (text == "forever") return {shm::kForever, {}};
  const std::size_t digits = text.find_first_not_of("0123456789");
  if (text.empty() || digits == 0) return refuse("is not a whole number with a unit", words.advice);
  if (digits == std::string_view::npos) return refuse("has no unit", words.advice);

  const std::string_view unit = text.substr(digits);
  const auto* known = kUnits.begin();
  while (known != kUnits.end() && known->first != unit) ++known;
  if (known == kUnits.end()) {
    const bool fraction = unit.starts_with('.') || unit.starts_with(',');
    return refuse(fraction ? "is a fraction" : "has an unknown unit",
                  fraction ? "take a smaller unit" : words.advice);
  }
  // A finite end of activity, arrival + T, must stay below what the activity word holds.
  const shm::Nanoseconds most = shm::kMaxTime / known->second;
  shm::Nanoseconds value = 0;
  for (const char digit : text.substr(0, digits)) {
    value = value <= most / 10 ? value * 10 + (digit - '0') : most + 1;
    if (value > most) {
      return refuse("is longer than the limit of " + std::to_string(shm::kMaxTime) + "ns",
                    words.shorten);
    }
  }
  if (value == 0) {
    return refuse(std::string(words.zero), "write at least 1ns");
  }
  return {value * known->second, {}};
}

}  // namespace arbiter::rules
