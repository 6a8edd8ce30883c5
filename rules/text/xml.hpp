// XML as a tree of views into the file, nothing decoded yet, so that everything keeps its place.
//
// pugixml does the parsing and stays behind this header. It knows offsets only of what it has not
// touched; hence it is told to leave character references and line ends alone, and decode() below
// deals with them.
#pragma once

#include <deque>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "rules/text/diagnostic.hpp"
#include "rules/text/text.hpp"
#include "rules/text/text_file.hpp"

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

// A tag, comment, CDATA section, declaration or instruction, as a scan of the bytes finds it.
struct Markup {
  enum class Kind { kOpening, kClosing, kEmpty, kOther };
  Kind kind = Kind::kOther;
  std::string_view name;  // of a tag
  std::size_t begin = 0;
  std::size_t end = 0;  // behind its last byte; npos if it does not end
};

// The first that begins at or behind `from`, in content that is well-formed up to its end.
std::optional<Markup> find_markup(std::string_view content, std::size_t from);

// Where an element stands in the bytes of a file, its tags included.
struct Extent {
  std::size_t begin = 0;
  std::size_t end = 0;
  std::size_t inner_end = 0;  // where its closing tag begins; `end` if it has none: <a/>
};

// The root of a well-formed document and the elements right inside it, in order. What stands behind
// the root is not looked at.
struct Outline {
  std::string_view root;
  Extent extent;
  std::vector<std::pair<std::string_view, Extent>> children;
};
std::optional<Outline> outline(std::string_view content);

// The name of the first element; empty if there is none.
std::string_view root_name(std::string_view content);

// Where an element's tag begins.
Location locate(const TextFile& file, const XmlNode& element);

// Appends a piece of text or an attribute's value, its references decoded. Reports what is
// malformed, once, and returns false.
bool decode(const TextFile& file, std::string_view written, Text& text, Diagnostics& diagnostics);

// "&amp;" for '&', and so for all that has a meaning in text or in an attribute's double quotes;
// empty for what may stand there as it is.
std::string_view reference_for(char character);

// A text as it stands in a file: for what is to be copied from a message, too.
std::string escape_xml(std::string_view text);

}  // namespace arbiter::rules
