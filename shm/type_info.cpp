#include "shm/type_info.hpp"

#include "shm/utf8.hpp"

namespace arbiter::shm {
namespace {

// Of a node's name in a mismatch: two of them, and two types, must fit into a message's text.
constexpr std::size_t kMaxNodeText = 100;

// `of`: a node's name, cut between two characters where it is long.
std::string by(std::string_view of) {
  if (of.empty()) return {};
  std::string text = printable(of);
  if (text.size() > kMaxNodeText) {
    std::size_t length = kMaxNodeText;
    while (length != 0 && (static_cast<unsigned char>(text[length]) & 0xc0) == 0x80) --length;
    text = text.substr(0, length) + "...";
  }
  return " of \"" + text + "\"";
}

std::optional<std::string> fault_of_name(std::string_view name) {
  while (!name.empty()) {
    const Utf8Character character = decode_utf8(name);
    if (character.length == 0) return "its name has a byte in it that is not UTF-8";
    if (is_control(character.code) || is_invisible(character.code)) {
      return "its name has a control character or an invisible one in it";
    }
    name.remove_prefix(character.length);
  }
  return {};
}

}  // namespace

std::optional<std::string> fault_of(const TypeInfo& type) {
  if (auto fault = fault_of_name(type.type_name())) return fault;
  if (type.is_typed() && type.size == 0) return "it has no bytes";
  if (type.size > kMaxTypeSize)
    return "it has more than " + std::to_string(kMaxTypeSize) + " bytes";
  if (type.is_variable()) return {};
  const bool is_power = type.alignment != 0 && (type.alignment & (type.alignment - 1)) == 0;
  if (!is_power || type.alignment > kMaxAlignment) {
    return "its alignment is " + std::to_string(type.alignment) +
           ", but must be a power of two, at most " + std::to_string(kMaxAlignment);
  }
  return {};
}

std::string describe(const TypeInfo& type) {
  const std::string size = std::to_string(type.size) + (type.size == 1 ? " byte" : " bytes");
  if (!type.is_typed()) return "untyped samples (up to " + size + ")";
  if (type.is_variable()) return printable(type.type_name()) + " (of any size)";
  return printable(type.type_name()) + " (" + size + ", aligned to " +
         std::to_string(type.alignment) + ")";
}

std::string type_mismatch(const TypeInfo& output, const TypeInfo& input, std::string_view sender,
                          std::string_view receiver) {
  if (!input.is_typed() || output == input) return {};
  return "the output port" + by(sender) + " sends " + describe(output) + ", the input port" +
         by(receiver) + " takes " + describe(input);
}

}  // namespace arbiter::shm
