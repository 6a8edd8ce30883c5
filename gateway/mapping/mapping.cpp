#include "gateway/mapping/mapping.hpp"

#include <array>
#include <charconv>
#include <cstdlib>
#include <limits>
#include <string_view>
#include <system_error>

namespace arbiter::gateway {
namespace {

template <class Number>
Range range_of_type() {
  return {static_cast<long double>(std::numeric_limits<Number>::lowest()),
          static_cast<long double>(std::numeric_limits<Number>::max())};
}

}  // namespace

const char* name_of(Kind kind) { return kind == Kind::kDds ? "dds" : "iceoryx"; }

std::optional<std::uint32_t> domain_of_environment() {
  const char* const value = std::getenv("ROS_DOMAIN_ID");
  if (value == nullptr || *value == '\0') return 0;
  const std::string_view text = value;
  const char* const end = text.data() + text.size();
  std::uint32_t domain = 0;
  const auto [rest, error] = std::from_chars(text.data(), end, domain);
  if (error != std::errc() || rest != end || domain > kMaxDomain) return {};
  return domain;
}

std::size_t size_of(Field field) {
  switch (field) {
    case Field::kBoolean:
    case Field::kI8:
    case Field::kU8:
      return 1;
    case Field::kI16:
    case Field::kU16:
      return 2;
    case Field::kI32:
    case Field::kU32:
    case Field::kF32:
      return 4;
    case Field::kI64:
    case Field::kU64:
    case Field::kF64:
      break;
  }
  return 8;
}

const char* name_of(Field field) {
  constexpr std::array<const char*, 11> kNames{"Boolean", "i8",  "u8",  "i16", "u16", "i32",
                                               "u32",     "i64", "u64", "f32", "f64"};
  return kNames.at(static_cast<std::size_t>(field));
}

Range range_of(Field field) {
  switch (field) {
    case Field::kBoolean:
      return range_of_type<bool>();
    case Field::kI8:
      return range_of_type<std::int8_t>();
    case Field::kU8:
      return range_of_type<std::uint8_t>();
    case Field::kI16:
      return range_of_type<std::int16_t>();
    case Field::kU16:
      return range_of_type<std::uint16_t>();
    case Field::kI32:
      return range_of_type<std::int32_t>();
    case Field::kU32:
      return range_of_type<std::uint32_t>();
    case Field::kI64:
      return range_of_type<std::int64_t>();
    case Field::kU64:
      return range_of_type<std::uint64_t>();
    case Field::kF32:
      return range_of_type<float>();
    case Field::kF64:
      break;
  }
  return range_of_type<double>();
}

std::vector<const Port*> Entry::ports() const {
  std::vector<const Port*> ports;
  if (port) ports.push_back(&*port);
  if (choice && choice->yes) ports.push_back(&*choice->yes);
  if (choice && choice->no) ports.push_back(&*choice->no);
  return ports;
}

std::string Entry::outside() const {
  if (dds) return "DDS topic " + dds->name;
  if (iceoryx)
    return "iceoryx " + iceoryx->service + "/" + iceoryx->instance + "/" + iceoryx->event;
  return {};
}

bool have_one_header(const Entry& in, const Entry& out) {
  static const IceoryxTopic none;  // DDS has no user headers
  const IceoryxTopic& a = in.iceoryx ? *in.iceoryx : none;
  const IceoryxTopic& b = out.iceoryx ? *out.iceoryx : none;
  return a.user_header == b.user_header && a.padded_header() == b.padded_header();
}

std::string header_text(const Entry& entry) {
  if (!entry.iceoryx || entry.iceoryx->user_header == 0) return "no user header";
  return "a user header of " + std::to_string(entry.iceoryx->user_header) + " bytes" +
         (entry.iceoryx->padded_header() == entry.iceoryx->user_header
              ? ""
              : ", padded to " + std::to_string(entry.iceoryx->padded_header()));
}

std::string header_advice(const Entry& in, const Entry& out) {
  if (!out.iceoryx) return "DDS has no user headers: connect a topic without one";
  if (!in.iceoryx || in.iceoryx->user_header == 0) return "remove user_header=\"…\" at the <out>";
  std::string advice = "write user_header=\"" + std::to_string(in.iceoryx->user_header) + "\"";
  if (in.iceoryx->alignment != out.iceoryx->alignment) {
    advice += " alignment=\"" + std::to_string(in.iceoryx->alignment) + "\"";
  }
  return advice + " at the <out>";
}

bool have_one_configuration(const Gateway& a, const Gateway& b) {
  return a.interfaces == b.interfaces && a.peers == b.peers && a.configuration == b.configuration;
}

}  // namespace arbiter::gateway
