#include "rules/text/text.hpp"

#include <algorithm>

#include "rules/text/names.hpp"

namespace arbiter::rules {

void Text::append(std::string_view bytes, std::size_t offset) {
  bytes_ += bytes;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    offsets_.push_back(static_cast<std::uint32_t>(offset + i));
  }
  end_ = offset + bytes.size();
}

void Text::append_for(std::string_view bytes, std::size_t offset, std::size_t length) {
  bytes_ += bytes;
  offsets_.insert(offsets_.end(), bytes.size(), static_cast<std::uint32_t>(offset));
  end_ = offset + length;
}

void Text::append_define(std::string_view name, std::string_view bytes, const Text& other,
                         std::size_t first, std::size_t last) {
  const std::size_t offset = other.offset(first);
  expansions_.push_back({bytes_.size(), bytes_.size() + bytes.size(), std::string(name)});
  append_for(bytes, offset, other.offset(last - 1) + 1 - offset);
}

void Text::append_part(const Text& other, std::size_t first, std::size_t last) {
  if (first == last) return;
  bytes_.append(other.bytes_, first, last - first);
  offsets_.insert(offsets_.end(), other.offsets_.begin() + static_cast<std::ptrdiff_t>(first),
                  other.offsets_.begin() + static_cast<std::ptrdiff_t>(last));
  end_ = last == other.bytes_.size() ? other.end_ : other.offset(last);
}

bool Text::is_blank() const { return trim(bytes_).empty(); }

Location Text::where() const {
  const std::size_t first = bytes_.find_first_not_of(" \t\r\n");
  return where(first == std::string::npos ? 0 : first);
}

std::string Text::origin(std::size_t i) const {
  if (i == bytes_.size() && i > 0) --i;
  const std::string define = define_of(i, i + 1);
  return define.empty() ? define : " (in the text of ${" + define + "})";
}

std::string Text::define_of(std::size_t first, std::size_t last) const {
  const auto at =
      std::partition_point(expansions_.begin(), expansions_.end(),
                           [first](const Expansion& expansion) { return expansion.last <= first; });
  return at != expansions_.end() && at->first <= first && last <= at->last ? at->define
                                                                           : std::string();
}

}  // namespace arbiter::rules
