// An <in> or <out> of a mapping.
#pragma once

#include <optional>
#include <string>

#include "gateway/mapping/mapping.hpp"
#include "gateway/mapping/read_file.hpp"
#include "rules/model/element_reader.hpp"

namespace arbiter::gateway {

struct EntryContext {
  Kind kind = Kind::kDds;
  // Where files lie that the mapping names; null: they are not looked at.
  const std::string* directory = nullptr;
  const ReadFile& read_file;
};

// Nothing where too much of it is wrong to check it any further; that was reported.
std::optional<Entry> read_entry(rules::ElementReader& reader, const rules::XmlNode& element,
                                const EntryContext& context);

}  // namespace arbiter::gateway
