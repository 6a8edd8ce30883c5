// Mappings given as text.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "gateway/mapping/check_mapping.hpp"
#include "gateway/mapping/read_mapping.hpp"
#include "rules/model/load.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::gateway {

struct Read {
  Mapping mapping;
  rules::Diagnostics diagnostics;

  // "2:14 error unknown-attribute", each.
  [[nodiscard]] std::vector<std::string> findings() const {
    static constexpr const char* kSeverities[] = {"error", "warning", "note"};
    std::vector<std::string> result;
    for (const rules::Diagnostic& item : diagnostics.items()) {
      result.push_back(std::to_string(item.where.line) + ":" + std::to_string(item.where.column) +
                       " " + kSeverities[static_cast<int>(item.severity)] + " " + item.code);
    }
    return result;
  }
  [[nodiscard]] std::string message(std::size_t i = 0) const {
    return i < diagnostics.items().size() ? diagnostics.items()[i].message : "";
  }
  [[nodiscard]] const Entry& entry(std::size_t i = 0) const {
    return mapping.gateways.at(0).entries.at(i);
  }
};

inline Read read_text(const std::string& text, const std::string* directory = nullptr) {
  Read read;
  const rules::TextFile file("mapping.xml", text);
  read.mapping = read_mapping(file, read.diagnostics, directory);
  return read;
}

// Entries in a gateway of DDS, which begin on line 1.
inline Read read_dds(const std::string& entries) {
  return read_text("<gateway kind='dds'>" + entries + "</gateway>");
}
inline Read read_iceoryx(const std::string& entries) {
  return read_text("<gateway kind='iceoryx'>" + entries + "</gateway>");
}

}  // namespace arbiter::gateway
