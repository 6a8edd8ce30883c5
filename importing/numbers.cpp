#include "importing/numbers.hpp"

#include <charconv>
#include <cmath>
#include <system_error>

#include "rules/text/names.hpp"

namespace arbiter::importing {
namespace {

constexpr std::string_view kDigits = "0123456789";

std::string_view without_sign(std::string_view text) {
  if (text.starts_with('+') || text.starts_with('-')) text.remove_prefix(1);
  return text;
}

// Of a number with an exponent ROS 1's reader makes a text, but where it has a point and the
// exponent a sign; and of one with a sign, where no digit is before the point.
bool is_read_differently(std::string_view text) {
  const std::string_view digits_first = without_sign(text);
  if (digits_first.size() != text.size() && digits_first.starts_with('.')) return true;
  const std::size_t exponent = text.find_first_of("eE");
  if (exponent == std::string_view::npos) return false;
  const std::string_view digits = text.substr(exponent + 1);
  const bool has_sign = digits.starts_with('+') || digits.starts_with('-');
  return text.substr(0, exponent).find('.') == std::string_view::npos || !has_sign;
}

bool are_digits(std::string_view text) {
  return !text.empty() && text.find_first_not_of(kDigits) == std::string_view::npos;
}

// What is not a plain decimal number at all.
std::string find_problem(const YamlNode& node, const std::string& example) {
  if (!node.is_scalar()) return "it is a list or a map; write a number, such as " + example;
  if (node.is_null()) return "it has no value; write a number, such as " + example;
  if (!node.is_plain) {
    return "the quotes make a text of " + rules::quote(node.text) + "; remove them";
  }
  const std::string_view digits = without_sign(node.text);
  if (are_digits(digits) && digits.size() > 1 && digits.starts_with('0')) {
    return "a number that begins with 0 is octal to some readers; write it without";
  }
  return "";
}

// from_chars, but for a plus.
template <typename T>
std::errc read_all(std::string_view text, T& value) {
  if (text.starts_with('+')) text.remove_prefix(1);
  const char* const end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, value);
  if (read.ec == std::errc() && read.ptr != end) return std::errc::invalid_argument;
  return read.ec;
}

}  // namespace

bool is_whole(const YamlNode& node) { return are_digits(without_sign(node.text)); }

Number<std::int64_t> read_integer(const YamlNode& node) {
  if (auto problem = find_problem(node, "100"); !problem.empty()) return {{}, problem};
  std::int64_t value = 0;
  const std::errc error = is_whole(node) ? read_all(node.text, value) : std::errc::invalid_argument;
  if (error == std::errc::result_out_of_range) {
    return {{}, rules::quote(node.text) + " is too large; write a smaller number"};
  }
  if (error != std::errc()) {
    return {{}, rules::quote(node.text) + " is not a whole number; write one, such as 100"};
  }
  return {value, ""};
}

Number<shm::Nanoseconds> read_seconds(const YamlNode& node) {
  if (auto problem = find_problem(node, "0.5"); !problem.empty()) return {{}, problem};
  const std::string_view digits = without_sign(node.text);
  const bool begins_as_number =
      !digits.empty() && (kDigits.find(digits.front()) != std::string_view::npos ||
                          (digits.front() == '.' && are_digits(digits.substr(1, 1))));
  double value = 0;
  const std::errc error =
      begins_as_number ? read_all(node.text, value) : std::errc::invalid_argument;
  const bool is_out_of_range =
      error == std::errc::result_out_of_range || std::abs(value) > kMostSeconds;
  if (is_out_of_range) {
    return {{},
            rules::quote(node.text) +
                " s is out of range; write at most 1000000000 s, and 0 "
                "or at least a nanosecond"};
  }
  if (error != std::errc()) {
    return {{}, rules::quote(node.text) + " is not a number; write seconds, such as 0.5"};
  }
  if (is_read_differently(node.text)) {
    return {{},
            rules::quote(node.text) +
                " is a text to some readers; write it as in -0.5, without an exponent, or as in "
                "5.0e-1"};
  }
  const shm::Nanoseconds rounded = std::llround(value * 1e9);
  if (rounded == 0 && value != 0) {
    return {{},
            rules::quote(node.text) +
                " s is less than a nanosecond; write a timeout that a "
                "message can keep"};
  }
  return {rounded, ""};
}

}  // namespace arbiter::importing
