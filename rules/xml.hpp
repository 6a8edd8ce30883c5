// XML as a tree of views into the file, nothing decoded yet, so that everything keeps its place.
//
// pugixml does the parsing and stays behind this header. It knows offsets only of what it has not
// touched; hence it is told to leave character references and line ends alone, and decode() below
// deals with them.
#pragma once

#include <deque>
#include <optional>
#include <string_view>
#include <vector>

#include "rules/diagnostic.hpp"
#include "rules/text.hpp"
#include "rules/text_file.hpp"

namespace arbiter::rules {

enum class XmlKind { kElement, kText, kCData };

struct XmlAttribute {
  std::string_view name;
  std::string_view value;  // as written
};

struct XmlNode {
  XmlKind kind = XmlKind::kElement;
  std::string_view text;  // an element's name; else the text as written
  std::vector<XmlAttribute> attributes;
  const XmlNode* first_child = nullptr;
  const XmlNode* next = nullptr;  // sibling
};

// Comments, declarations and processing instructions are left out.
class XmlDocument {
 public:
  [[nodiscard]] const XmlNode* first() const { return nodes_.empty() ? nullptr : &nodes_.front(); }

 private:
  friend std::optional<XmlDocument> parse_xml(const TextFile&, Diagnostics&);

  std::deque<XmlNode> nodes_;  // a deque, since nodes point at each other
};

// A document, or a list of elements without a root. Reports what is malformed.
std::optional<XmlDocument> parse_xml(const TextFile& file, Diagnostics& diagnostics);

// Where an element's tag begins.
Location locate(const TextFile& file, const XmlNode& element);

// Appends a piece of text or an attribute's value, its references decoded. Reports what is
// malformed, once, and returns false.
bool decode(const TextFile& file, std::string_view written, Text& text, Diagnostics& diagnostics);

}  // namespace arbiter::rules
