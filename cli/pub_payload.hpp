// What arbiter pub sends: the bytes of its samples, from the command line or from a file.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <arbiter/type.hpp>

namespace arbiter::cli {

// A sample is held in memory a few times; a file may have no end, and any component may declare a
// type of a terabyte.
inline constexpr std::size_t kMaxPayload = std::size_t{1} << 30;

// At most one of them is given.
struct PayloadOptions {
  std::optional<std::size_t> size;  // zeros
  std::optional<std::string> text;
  std::optional<std::string> hex;
  std::optional<std::string> file;  // "-": standard input

  // The option that gives the payload, "--hex"; empty: none does.
  [[nodiscard]] const char* name() const;
};

// "0a0B ff" as three bytes. Throws CLI::ValidationError, which says where it is wrong.
[[nodiscard]] std::vector<std::byte> bytes_of_hex(std::string_view hex);

// What the options say; where they say nothing, none. Reads the file to its end, which may block.
// Throws CLI::ValidationError; rules::FileError where the file cannot be read or is too large.
[[nodiscard]] std::optional<std::vector<std::byte>> read_payload(const PayloadOptions& options);

// The payload, or if there is none, as many zeros as a sample of the type has. Throws
// CLI::ValidationError if a sample cannot have that many bytes.
[[nodiscard]] std::vector<std::byte> payload_of(std::optional<std::vector<std::byte>> payload,
                                                const PayloadOptions& options, const Type& type);

}  // namespace arbiter::cli
