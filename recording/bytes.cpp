#include "recording/bytes.hpp"

#include <limits>

namespace arbiter::recording {
namespace {

// A map of many short entries takes ten times the memory of its bytes.
constexpr std::size_t kMostEntries = 65'536;

std::uint32_t length_of(std::size_t size) {
  if (size > std::numeric_limits<std::uint32_t>::max()) {
    throw McapError("MCAP has no room for a text of " + std::to_string(size) +
                    " bytes: at most 4294967295");
  }
  return static_cast<std::uint32_t>(size);
}

}  // namespace

void append_string(std::string& out, std::string_view text) {
  append(out, length_of(text.size()));
  out += text;
}

void append_map(std::string& out, const McapMap& map) {
  std::string entries;
  for (const auto& [key, value] : map) {
    append_string(entries, key);
    append_string(entries, value);
  }
  append_string(out, entries);
}

std::string_view ByteReader::bytes(std::uint64_t count) {
  if (count > bytes_.size()) {
    throw Damage{"a field of " + std::to_string(count) + " bytes does not fit into the " +
                 std::to_string(bytes_.size()) + " that are left of it"};
  }
  const std::string_view taken = bytes_.substr(0, count);
  bytes_.remove_prefix(count);
  return taken;
}

McapMap ByteReader::map() {
  ByteReader entries(string());
  McapMap result;
  while (entries.left() > 0) {
    const std::string_view key = entries.string();
    const std::string_view value = entries.string();
    result.emplace(key, value);
    if (result.size() > kMostEntries) {
      throw Damage{"a map has more than " + std::to_string(kMostEntries) + " entries"};
    }
  }
  return result;
}

}  // namespace arbiter::recording
