#include "cli/pub_payload.hpp"

#include <sys/stat.h>

#include <array>
#include <cstdint>
#include <iostream>
#include <utility>

#include <CLI/CLI.hpp>

#include "cli/pub_type.hpp"
#include "rules/text/text_file.hpp"
#include "shm/utf8.hpp"

namespace arbiter::cli {
namespace {

std::optional<unsigned> digit_of(char digit) {
  if (digit >= '0' && digit <= '9') return static_cast<unsigned>(digit - '0');
  if (digit >= 'a' && digit <= 'f') return static_cast<unsigned>(digit - 'a' + 10);
  if (digit >= 'A' && digit <= 'F') return static_cast<unsigned>(digit - 'A' + 10);
  return {};
}

std::string count_of(std::size_t bytes) {
  return std::to_string(bytes) + (bytes == 1 ? " byte" : " bytes");
}

std::string read_standard_input() {
  std::string content;
  std::array<char, 65536> buffer;
  while (content.size() <= kMaxPayload && std::cin) {
    std::cin.read(buffer.data(), buffer.size());
    content.append(buffer.data(), static_cast<std::size_t>(std::cin.gcount()));
  }
  if (std::cin.bad()) throw rules::FileError("cannot read standard input");
  return content;
}

// Whether it is so before it is read, which would take a while.
bool is_too_large(const std::string& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode) &&
         static_cast<std::uintmax_t>(status.st_size) > kMaxPayload;
}

std::string read_file(const std::string& path) {
  const bool is_input = path == "-";
  if (is_input || !is_too_large(path)) {
    std::string content = is_input ? read_standard_input() : rules::read_bytes(path, kMaxPayload);
    if (content.size() <= kMaxPayload) return content;
  }
  throw rules::FileError((is_input ? "standard input" : path) + " has more than " +
                         std::to_string(kMaxPayload >> 20) +
                         " MiB, too much for one sample; give a smaller file");
}

std::vector<std::byte> as_bytes(std::string_view text) {
  const auto* const bytes = reinterpret_cast<const std::byte*>(text.data());
  return {bytes, bytes + text.size()};
}

}  // namespace

const char* PayloadOptions::name() const {
  if (text) return "--text";
  if (hex) return "--hex";
  if (file) return "--file";
  return size ? "--size" : "";
}

std::vector<std::byte> bytes_of_hex(std::string_view hex) {
  std::vector<std::byte> bytes;
  std::optional<unsigned> high;
  for (std::size_t at = 0; at < hex.size(); ++at) {
    if (shm::is_blank(hex[at])) continue;
    const auto digit = digit_of(hex[at]);
    if (!digit) {
      throw CLI::ValidationError(
          "--hex", "character " + std::to_string(at + 1) +
                       " is not a hexadecimal digit; write two digits for each byte, such as 0A0B");
    }
    if (high) bytes.push_back(static_cast<std::byte>(*high << 4 | *digit));
    high = high ? std::nullopt : digit;
  }
  if (high) {
    throw CLI::ValidationError("--hex", "there is half a byte at the end, behind " +
                                            count_of(bytes.size()) +
                                            "; write two digits for each byte, such as 0A0B");
  }
  return bytes;
}

std::optional<std::vector<std::byte>> read_payload(const PayloadOptions& options) {
  if (options.text) return as_bytes(*options.text);
  if (options.hex) return bytes_of_hex(*options.hex);
  if (options.file) return as_bytes(read_file(*options.file));
  if (options.size) return std::vector<std::byte>(*options.size);
  return {};
}

std::vector<std::byte> payload_of(std::optional<std::vector<std::byte>> payload,
                                  const PayloadOptions& options, const Type& type) {
  if (!payload && type.is_variable()) {
    throw CLI::ValidationError("--file", "a sample of " + describe(type) +
                                             " is written by somebody who knows the type; "
                                             "give one with --file, --hex or --text");
  }
  if (!payload && type.size() <= kMaxPayload) return std::vector<std::byte>(type.size());
  if (!payload) {
    throw CLI::ValidationError("--size", "a sample of " + describe(type) + " is larger than " +
                                             std::to_string(kMaxPayload >> 20) +
                                             " MiB, the most that pub sends");
  }
  const bool may_differ = !type.has_one_size() && payload->size() <= type.size();
  if (type.is_untyped() || may_differ || type.size() == payload->size()) return std::move(*payload);
  throw CLI::ValidationError(options.name(), "the payload has " + count_of(payload->size()) +
                                                 ", but a sample of " + describe(type) + " has " +
                                                 count_of(type.size()) + "; nothing was published");
}

}  // namespace arbiter::cli
