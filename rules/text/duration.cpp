#include "rules/text/duration.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "rules/text/names.hpp"

namespace arbiter::rules {
namespace {

constexpr std::string_view kForever = "forever";

using Unit = std::pair<std::string_view, shm::Nanoseconds>;
// The largest first.
constexpr std::array<Unit, 4> kUnits{
    {{"s", 1'000'000'000}, {"ms", 1'000'000}, {"us", 1'000}, {"ns", 1}}};
constexpr Unit kMinutes{"min", 60'000'000'000};

// Null: there is none of that name.
const Unit* find_unit(std::string_view name, bool takes_minutes) {
  if (takes_minutes && name == kMinutes.first) return &kMinutes;
  const auto* const unit = std::find_if(kUnits.begin(), kUnits.end(),
                                        [&](const Unit& each) { return each.first == name; });
  return unit == kUnits.end() ? nullptr : unit;
}

// What others write for a unit, and how many of which of ours it is.
struct ForeignUnit {
  std::string_view spelling, unit;
  shm::Nanoseconds count = 1;
};
constexpr auto kForeignUnits = std::to_array<ForeignUnit>({{"h", "s", 3600},
                                                           {"hour", "s", 3600},
                                                           {"hours", "s", 3600},
                                                           {"min", "s", 60},
                                                           {"minute", "s", 60},
                                                           {"minutes", "s", 60},
                                                           {"sec", "s"},
                                                           {"second", "s"},
                                                           {"seconds", "s"},
                                                           {"msec", "ms"},
                                                           {"usec", "us"},
                                                           {"µs", "us"},
                                                           {"μs", "us"},
                                                           {"nsec", "ns"}});

// "300s" for "5min" and "5 min"; empty: it is no such duration, or too long.
std::string in_our_units(std::string_view digits, std::string_view written) {
  std::string unit = lower_case(trim(written));
  shm::Nanoseconds count = 1;
  for (const ForeignUnit& each : kForeignUnits) {
    if (each.spelling != unit) continue;
    unit = each.unit;
    count = each.count;
    break;
  }
  if (find_unit(unit, false) == nullptr) return {};
  const ParsedDuration parsed = parse_duration(std::string(digits) + unit);
  if (!parsed.problem.empty() || parsed.value > shm::kMaxTime / count) return {};
  return to_string(parsed.value * count);
}

// "500ms" for "0.5s"; empty: it is no such fraction, or no whole number of nanoseconds.
std::string without_fraction(std::string_view text, bool takes_minutes) {
  constexpr std::string_view kDigits = "0123456789";
  constexpr std::size_t kMostDigits = 9;  // of each part, so that the product fits
  const std::size_t point = text.find_first_not_of(kDigits);
  const std::size_t end = text.find_first_not_of(kDigits, point + 1);
  if (end == std::string_view::npos || end == point + 1) return {};
  if (point > kMostDigits || end - point - 1 > kMostDigits) return {};
  shm::Nanoseconds scale = 1;
  shm::Nanoseconds number = 0;
  for (std::size_t i = 0; i < end; ++i) {
    if (i == point) continue;
    number = number * 10 + (text[i] - '0');
    if (i > point) scale *= 10;
  }
  const Unit* const unit = find_unit(text.substr(end), takes_minutes);
  if (unit == nullptr || number == 0) return {};
  // In the largest of the smaller units in which it is whole.
  for (const auto& [name, length] : kUnits) {
    if (length >= unit->second) continue;
    const shm::Nanoseconds factor = unit->second / length;
    if (number > shm::kMaxTime / factor) return {};
    if (number * factor % scale == 0) {
      return std::to_string(number * factor / scale) + std::string(name);
    }
  }
  return {};
}

}  // namespace

ParsedDuration parse_duration(std::string_view text, const DurationWords& words) {
  const auto refuse = [&](const std::string& why, std::string_view advice) {
    return ParsedDuration{
        0, std::string(words.subject) + quote(text) + " " + why + "; " + std::string(advice)};
  };
  if (words.takes_forever && text == kForever) return {shm::kForever, {}};
  const bool lacks_zero = text.starts_with('.') || text.starts_with(',');
  if (lacks_zero) return parse_duration("0" + std::string(text), words);
  const std::size_t digits = text.find_first_not_of("0123456789");
  if (text.empty() || digits == 0) {
    const std::string word = lower_case(text);
    const bool is_endless =
        word.starts_with("inf") || word == "never" || word == "always" || word == "-1";
    const bool means_forever =
        words.takes_forever && (is_endless || find_similar(text, {kForever}));
    return refuse("is not a whole number with a unit",
                  means_forever ? "did you mean \"forever\"?" : words.advice);
  }
  if (digits == std::string_view::npos) return refuse("has no unit", words.advice);

  const std::string_view unit = text.substr(digits);
  const Unit* const known = find_unit(unit, words.takes_minutes);
  if (known == nullptr) {
    if (unit.find_first_not_of("0123456789.,") == std::string_view::npos)
      return refuse("has no unit", words.advice);
    const std::string_view number = text.substr(0, digits);
    const std::string why = unit.front() == ' ' ? "has a blank" : "has an unknown unit";
    if (const auto ours = in_our_units(number, unit); !ours.empty())
      return refuse(why, "write " + ours + " in its place");
    if (const auto seconds = in_our_units(number, "min");
        lower_case(trim(unit)) == "m" && !seconds.empty()) {
      const std::string count(number);
      return refuse("has an unknown unit", "write " +
                                               (words.takes_minutes ? count + "min" : seconds) +
                                               " for minutes, or " + count + "ms for milliseconds");
    }
    const bool is_fraction = unit.starts_with('.') || unit.starts_with(',');
    if (find_unit(trim(unit), words.takes_minutes) != nullptr)
      return refuse(why, "write the unit right behind the number, as in 500ms");
    if (!is_fraction) return refuse("has an unknown unit", words.advice);
    const std::string whole = without_fraction(text, words.takes_minutes);
    return refuse("is a fraction",
                  whole.empty() ? "take a smaller unit" : "write " + whole + " in its place");
  }
  // A finite end of activity, arrival + T, must stay below what the activity word holds.
  const shm::Nanoseconds most = shm::kMaxTime / known->second;
  shm::Nanoseconds value = 0;
  for (const char digit : text.substr(0, digits)) {
    value = value <= most / 10 ? value * 10 + (digit - '0') : most + 1;
    if (value > most) {
      return refuse(
          "is longer than the limit of " + std::to_string(shm::kMaxTime) + "ns, about 73 years",
          words.shorten);
    }
  }
  if (value == 0) {
    return refuse(std::string(words.zero), "write at least 1ns");
  }
  return {value * known->second, {}};
}

std::string to_string(shm::Nanoseconds timeout) {
  if (timeout == shm::kForever) return std::string(kForever);
  const auto* const unit = std::find_if(
      kUnits.begin(), kUnits.end(), [&](const auto& each) { return timeout % each.second == 0; });
  return std::to_string(timeout / unit->second) + std::string(unit->first);
}

}  // namespace arbiter::rules
