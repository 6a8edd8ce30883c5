// A JSON document that the daemon answers a question with.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include "shm/file_descriptor.hpp"

namespace arbiter::wire {

// A document that is not what it should be: the message says where, and what to do.
class DocumentError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// More than any daemon sends.
inline constexpr std::size_t kMaxDocument = std::size_t{256} << 20;
// Of objects and arrays in one another.
inline constexpr int kMaxNesting = 16;

// The text. Never waits for whoever has sent it: only memory is read. Throws DocumentError.
[[nodiscard]] std::string read_document(const shm::FileDescriptor& descriptor);

// Throws DocumentError where it is not JSON, not UTF-8, or nested more deeply than kMaxNesting.
[[nodiscard]] nlohmann::json parse_document(std::string_view text);

// As daemons write it: indented, and what is not UTF-8 replaced.
[[nodiscard]] std::string write_document(const nlohmann::json& document);

}  // namespace arbiter::wire
