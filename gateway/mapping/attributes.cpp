#include "gateway/mapping/attributes.hpp"

#include <charconv>
#include <cmath>

#include "rules/text/duration.hpp"
#include "rules/text/names.hpp"

namespace arbiter::gateway {
namespace {

constexpr std::size_t kMaxItems = 64;  // of a list

std::string quoted(std::string_view name) { return std::string(name) + "=\"…\""; }

std::uint64_t unit_of(std::string_view text) {
  if (text.empty()) return 1;
  if (text == "KiB") return std::uint64_t{1} << 10;
  if (text == "MiB") return std::uint64_t{1} << 20;
  if (text == "GiB") return std::uint64_t{1} << 30;
  return 0;
}

}  // namespace

std::optional<Attributes::Value> Attributes::value(std::string_view name) {
  const auto text = reader_.optional_attribute(element_, name);
  if (!text) return {};
  std::string trimmed(rules::trim(text->bytes()));
  if (trimmed.empty()) {
    reader_.error("empty-attribute", text->where(),
                  quoted(name) + " is empty; write its value, or leave it out");
    return {};
  }
  return Value{std::move(trimmed), text->where()};
}

rules::Location Attributes::where(std::string_view name) const {
  if (!has(name)) return reader_.where(element_);
  const auto text = reader_.optional_attribute(element_, name);
  return text ? text->where() : reader_.where(element_);
}

void Attributes::error(std::string code, std::string_view at_attribute, std::string message) {
  reader_.error(std::move(code), where(at_attribute), std::move(message));
}

void Attributes::refuse(const Value& value, std::string_view name,
                        const std::string& what_it_takes) {
  reader_.error("invalid-value", value.where,
                std::string(name) + "=" + rules::quote(value.text) + " is not " + what_it_takes);
}

void Attributes::refuse_word(std::string_view name, const Value& value,
                             const std::vector<std::string_view>& known) {
  std::string all;
  for (const std::string_view each : known) all += (all.empty() ? "" : ", ") + std::string(each);
  reader_.error("invalid-value", value.where,
                std::string(name) + "=" + rules::quote(value.text) + " is not known" +
                    rules::advise(value.text, known, "write one of " + all));
}

std::optional<std::string> Attributes::text(std::string_view name, std::size_t max) {
  auto found = value(name);
  if (!found) return {};
  if (found->text.size() > max) {
    refuse(*found, name, "short enough; write at most " + std::to_string(max) + " bytes");
    return {};
  }
  return std::move(found->text);
}

std::string Attributes::required(std::string_view name, std::size_t max) {
  if (!has(name)) {
    reader_.attribute(element_, name);  // reports it
    return {};
  }
  return text(name, max).value_or("");
}

std::optional<Port> Attributes::port(std::string_view name) {
  auto mention = reader_.port_attribute(element_, name);
  if (!mention) return {};
  return Port{std::move(mention->name), std::move(mention->where)};
}

std::optional<std::uint64_t> Attributes::whole(std::string_view name, std::uint64_t least,
                                               std::uint64_t most, bool with_units) {
  const auto found = value(name);
  if (!found) return {};
  std::uint64_t number = 0;
  const char* const end = found->text.data() + found->text.size();
  const auto [rest, fault] = std::from_chars(found->text.data(), end, number);
  const std::string_view unit(rest, static_cast<std::size_t>(end - rest));
  const std::uint64_t factor = with_units ? unit_of(unit) : (unit.empty() ? 1 : 0);
  const bool fits =
      fault == std::errc() && factor != 0 && number <= most / factor && number * factor >= least;
  if (fits) return number * factor;
  refuse(*found, name,
         "a whole number" + std::string(with_units ? " of bytes" : "") + " from " +
             std::to_string(least) + " to " + std::to_string(most) +
             (with_units ? "; write it in bytes, or with KiB or MiB" : ""));
  return {};
}

std::optional<std::uint64_t> Attributes::number(std::string_view name, std::uint64_t least,
                                                std::uint64_t most) {
  return whole(name, least, most, false);
}

std::optional<std::uint64_t> Attributes::bytes(std::string_view name, std::uint64_t least,
                                               std::uint64_t most) {
  return whole(name, least, most, true);
}

std::optional<long double> Attributes::real(std::string_view name) {
  const auto found = value(name);
  if (!found) return {};
  long double number = 0;
  const char* const end = found->text.data() + found->text.size();
  const auto [rest, fault] = std::from_chars(found->text.data(), end, number);
  if (fault == std::errc() && rest == end && std::isfinite(number)) return number;
  refuse(*found, name, "a number; write one such as 20, -0.5 or 1e-3");
  return {};
}

std::optional<shm::Nanoseconds> Attributes::duration(std::string_view name) {
  const auto found = value(name);
  if (!found) return {};
  const std::string subject = std::string(name) + "=";
  rules::DurationWords words{subject, "is zero", "shorten it",
                             "write a whole number with a unit, such as 250us, 100ms or 2s, or "
                             "leave it out"};
  words.takes_forever = false;
  rules::ParsedDuration parsed = rules::parse_duration(found->text, words);
  if (parsed.problem.empty()) return parsed.value;
  reader_.error("invalid-value", found->where, std::move(parsed.problem));
  return {};
}

std::vector<std::string> Attributes::list(std::string_view name, std::size_t max_each) {
  const auto found = value(name);
  if (!found) return {};
  std::vector<std::string> items;
  for (std::string_view rest = found->text;;) {
    const std::size_t comma = rest.find(',');
    const std::string_view item = rules::trim(rest.substr(0, comma));
    if (item.empty() || item.size() > max_each) {
      refuse(*found, name,
             "a list; write values of at most " + std::to_string(max_each) +
                 " bytes, with commas between them");
      return {};
    }
    if (items.size() == kMaxItems) {
      refuse(*found, name, "short enough; write at most " + std::to_string(kMaxItems) + " values");
      return {};
    }
    items.emplace_back(item);
    if (comma == std::string_view::npos) return items;
    rest.remove_prefix(comma + 1);
  }
}

std::optional<bool> Attributes::boolean(std::string_view name) {
  return word<bool>(name, {{"true", true}, {"false", false}});
}

}  // namespace arbiter::gateway
