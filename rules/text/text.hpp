// Text out of an XML file, decoded, of which each byte still knows its place in the file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "rules/text/diagnostic.hpp"
#include "rules/text/text_file.hpp"

namespace arbiter::rules {

class Text {
 public:
  // An empty text whose place is `start`.
  Text(const TextFile& file, std::size_t start) : file_(&file), end_(start) {}

  // An empty text at the same place.
  [[nodiscard]] Text empty_copy() const { return {*file_, offset(0)}; }

  // Bytes that stand in the file as they are, from `offset` on.
  void append(std::string_view bytes, std::size_t offset);
  // Bytes that `length` bytes of the file stand for: a character reference, or a define's use.
  void append_for(std::string_view bytes, std::size_t offset, std::size_t length);
  // A define's text, for its use that begins at byte `first` of `other` and ends before `last`.
  void append_define(std::string_view name, std::string_view bytes, const Text& other,
                     std::size_t first, std::size_t last);
  void append_part(const Text& other, std::size_t first, std::size_t last);

  [[nodiscard]] const std::string& bytes() const { return bytes_; }
  [[nodiscard]] bool is_blank() const;

  // Where byte `i` stands; the byte behind the last one, too.
  [[nodiscard]] Location where(std::size_t i) const { return file_->locate(offset(i)); }
  // Of the first byte that is not white space, or of the first at all.
  [[nodiscard]] Location where() const;
  // " (in the text of ${name})" for a byte that came out of a define, else nothing.
  [[nodiscard]] std::string origin(std::size_t i) const;
  // The define that all of these bytes came out of, in one use; else nothing.
  [[nodiscard]] std::string define_of(std::size_t first, std::size_t last) const;

 private:
  struct Expansion {
    std::size_t first, last;
    std::string define;
  };

  [[nodiscard]] std::size_t offset(std::size_t i) const {
    return i < offsets_.size() ? offsets_[i] : end_;
  }

  const TextFile* file_;
  std::string bytes_;
  std::vector<std::uint32_t> offsets_;  // in the file, of each byte
  std::size_t end_;                     // offset behind the last byte
  std::vector<Expansion> expansions_;   // in order
};

}  // namespace arbiter::rules
