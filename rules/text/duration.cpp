#include "rules/text/duration.hpp"

#include <array>
#include <utility>

#include "rules/text/names.hpp"

namespace arbiter::rules {
namespace {

constexpr std::array<std::pair<std::string_view, shm::Nanoseconds>, 4> kUnits{
    {{"ns", 1}, {"us", 1'000}, {"ms", 1'000'000}, {"s", 1'000'000'000}}};

constexpr std::string_view kAdvice =
    "write a whole number with a unit, such as 250ns, 10us, 500ms or 2s, or forever";

ParsedDuration refuse(std::string_view text, const std::string& why, std::string_view advice) {
  return {0, "the timeout " + quote(text) + " " + why + "; " + std::string(advice)};
}

}  // namespace

ParsedDuration parse_duration(std::string_view text) {
  if (text == "forever") return {shm::kForever, {}};
  const std::size_t digits = text.find_first_not_of("0123456789");
  if (text.empty() || digits == 0)
    return refuse(text, "is not a whole number with a unit", kAdvice);
  if (digits == std::string_view::npos) return refuse(text, "has no unit", kAdvice);

  const std::string_view unit = text.substr(digits);
  const auto* known = kUnits.begin();
  while (known != kUnits.end() && known->first != unit) ++known;
  if (known == kUnits.end()) {
    const bool fraction = unit.starts_with('.') || unit.starts_with(',');
    return refuse(text, fraction ? "is a fraction" : "has an unknown unit",
                  fraction ? "take a smaller unit" : kAdvice);
  }
  // A finite end of activity, arrival + T, must stay below what the activity word holds.
  const shm::Nanoseconds most = shm::kMaxTime / known->second;
  shm::Nanoseconds value = 0;
  for (const char digit : text.substr(0, digits)) {
    value = value <= most / 10 ? value * 10 + (digit - '0') : most + 1;
    if (value > most) {
      return refuse(text, "is longer than the limit of " + std::to_string(shm::kMaxTime) + "ns",
                    "shorten it, or write forever");
    }
  }
  if (value == 0) {
    return refuse(text, "is zero, so that its source would never be active", "write at least 1ns");
  }
  return {value * known->second, {}};
}

}  // namespace arbiter::rules
