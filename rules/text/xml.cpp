#include "rules/text/xml.hpp"

#include <array>
#include <charconv>
#include <cstring>
#include <pugixml.hpp>
#include <string>
#include <utility>

#include "rules/text/names.hpp"
#include "shm/utf8.hpp"

namespace arbiter::rules {
namespace {

constexpr unsigned kParseFlags = pugi::parse_cdata | pugi::parse_ws_pcdata | pugi::parse_fragment;

struct Tag {
  std::string_view name;
  std::size_t offset = 0;
};

// What a scan of the tags up to some byte finds.
struct Scan {
  std::vector<Tag> open;      // the elements that are not closed yet, innermost last
  std::size_t construct = 0;  // where the last tag, comment, … begins
  bool finished = true;       // whether that ends, too
};

// The end of a tag, or of a document type, which may have comments and others inside it; or npos.
std::size_t find_tag_end(std::string_view content, std::size_t begin) {
  char quoted = 0;
  std::size_t depth = 0;
  for (std::size_t i = begin; i < content.size(); ++i) {
    const char byte = content[i];
    if (quoted != 0) {
      if (byte == quoted) quoted = 0;
    } else if (byte == '"' || byte == '\'') {
      quoted = byte;
    } else if (content[begin] == '!' && content.substr(i).starts_with("<!--")) {
      i = content.find("-->", i + 4);
      if (i == std::string_view::npos) break;
      i += 2;
    } else if (content[begin] == '!' && byte == '<') {
      ++depth;
    } else if (byte == '>') {
      if (depth == 0) return i;
      --depth;
    }
  }
  return std::string_view::npos;
}

// pugixml says where it stumbled, not over what: this finds out. The file is known to be
// well-formed up to its last construct.
Scan scan(std::string_view content) {
  Scan result;
  for (auto markup = find_markup(content, 0); markup; markup = find_markup(content, markup->end)) {
    result.construct = markup->begin;
    if (markup->end == std::string_view::npos) {
      result.finished = false;
      break;
    }
    if (markup->kind == Markup::Kind::kClosing) {
      if (!result.open.empty()) result.open.pop_back();
    } else if (markup->kind == Markup::Kind::kOpening) {
      result.open.push_back({markup->name, markup->begin});
    }
  }
  return result;
}

struct Explanation {
  std::size_t offset;
  std::string message;
};

// Either a closing tag that does not fit, or the end of the file where one is missing.
Explanation explain_mismatch(const TextFile& file, const Scan& scanned,
                             pugi::xml_parse_status status) {
  const std::string_view content = file.content();
  std::string opened;
  if (!scanned.open.empty()) {
    const Tag& tag = scanned.open.back();
    opened =
        '<' + std::string(tag.name.substr(0, 80)) + "> of " + describe(file.locate(tag.offset));
  }
  if (scanned.finished) {
    return {content.find_last_not_of(" \t\r\n") + 1,
            "the file ends before " + opened + " is closed; close it"};
  }
  if (find_tag_end(content, scanned.construct) == std::string_view::npos) {
    return {scanned.construct, "this closing tag does not end; close it with '>'"};
  }
  if (status == pugi::status_bad_end_element) {
    return {scanned.construct, "this closing tag has more in it than a name; remove that"};
  }
  if (opened.empty()) {
    return {scanned.construct, "this closing tag closes nothing; remove it"};
  }
  return {scanned.construct,
          "this closing tag does not fit " + opened + ", which must be closed first"};
}

// What to write for a '<' that begins no tag: an operator, or what others write for one.
std::string_view advice_on_less_than(std::string_view text, const std::vector<Tag>& open) {
  if (text.starts_with("<->") || text.starts_with("<=>")) return "write iff for this operator";
  const bool is_condition =
      !open.empty() && (open.back().name == "condition" || open.back().name == "select");
  if (!is_condition) return "where the character is meant, write &lt;";
  if (text.starts_with("<-") || text.starts_with("<=")) {
    return "write implies, and what follows behind it";
  }
  return "a condition compares nothing, it says which sources are active";
}

// What decode() would say of the text in front of the place where the file cannot be read further.
// Of an application it would say it of few elements.
void report_references(const TextFile& file, std::size_t end, Diagnostics& diagnostics) {
  const std::string_view content = file.content().substr(0, end);
  if (root_name(content) == "application") return;
  for (std::size_t at = 0; at < end;) {
    const auto markup = find_markup(content, at);
    const std::size_t text_end = markup ? markup->begin : end;
    Text ignored(file, at);
    decode(file, content.substr(at, text_end - at), ignored, diagnostics);
    at = markup ? markup->end : end;
  }
}

Explanation explain(const TextFile& file, const pugi::xml_parse_result& result) {
  const auto offset = static_cast<std::size_t>(result.offset);
  const Scan scanned = scan(file.content().substr(0, offset + 1));
  const auto here = [&](std::string message) {
    return Explanation{scanned.construct, std::move(message)};
  };
  switch (result.status) {
    case pugi::status_bad_comment:
      return here("this comment does not end; close it with -->");
    case pugi::status_bad_cdata:
      return here("this CDATA section does not end; close it with ]]>");
    case pugi::status_bad_pi:
      return here("this declaration or processing instruction does not end; close it with ?>");
    case pugi::status_bad_doctype:
      return here("this document type is malformed; remove it, it is not needed");
    case pugi::status_bad_start_element:
      return here("this tag is malformed or does not end; close it with '>'");
    case pugi::status_bad_attribute:
      return here("an attribute of this tag is malformed; write name=\"value\"");
    case pugi::status_unrecognized_tag:
      return here(
          "'<' must begin a tag here; " +
          std::string(advice_on_less_than(file.content().substr(scanned.construct), scanned.open)));
    case pugi::status_bad_end_element:
    case pugi::status_end_element_mismatch:
      return explain_mismatch(file, scanned, result.status);
    default:
      return {offset, std::string("the XML cannot be read: ") + result.description()};
  }
}

// pugixml's own buffer and the file have the same bytes; this leads from one to the other.
class Views {
 public:
  Views(const TextFile& file, pugi::xml_node any)
      : content_(file.content()), base_(any ? start_of(any) : nullptr) {}

  [[nodiscard]] std::string_view of(const char* text) const {
    return content_.substr(static_cast<std::size_t>(text - base_), std::strlen(text));
  }

 private:
  static const char* start_of(pugi::xml_node node) {
    const bool is_element = node.type() == pugi::node_element;
    return (is_element ? node.name() : node.value()) - node.offset_debug();
  }

  std::string_view content_;
  const char* base_;
};

XmlNode copy(pugi::xml_node from, const Views& views) {
  XmlNode node;
  if (from.type() == pugi::node_element) {
    node.text = views.of(from.name());
    for (const pugi::xml_attribute attribute : from.attributes()) {
      node.attributes.push_back({views.of(attribute.name()), views.of(attribute.value())});
    }
  } else {
    node.kind = from.type() == pugi::node_cdata ? XmlKind::kCData : XmlKind::kText;
    node.text = views.of(from.value());
  }
  return node;
}

bool report(const TextFile& file, std::size_t offset, std::string message,
            Diagnostics& diagnostics) {
  diagnostics.error("malformed-xml", file.locate(offset), std::move(message));
  return false;
}

// The character that a reference such as "amp", "#945" or "#x3b1" names; empty if none.
std::string resolve_reference(std::string_view name) {
  static constexpr std::array<std::pair<std::string_view, char>, 5> kNamed{
      {{"amp", '&'}, {"lt", '<'}, {"gt", '>'}, {"quot", '"'}, {"apos", '\''}}};
  for (const auto& [known, character] : kNamed) {
    if (name == known) return {character};
  }
  if (!name.starts_with('#')) return {};
  name.remove_prefix(1);
  const bool hex = name.starts_with('x');
  if (hex) name.remove_prefix(1);
  std::uint32_t code = 0;
  const auto [end, error] =
      std::from_chars(name.data(), name.data() + name.size(), code, hex ? 16 : 10);
  const bool complete = error == std::errc{} && end == name.data() + name.size();
  if (!complete || code > 0x10ffff) return {};
  std::string bytes = shm::encode_utf8(code);
  const bool allowed = shm::decode_utf8(bytes).length != 0 &&
                       (!shm::is_control(code) || (code < 0x80 && shm::is_blank(bytes[0])));
  return allowed ? bytes : std::string();
}

}  // namespace

std::optional<XmlDocument> parse_xml(const TextFile& file, Diagnostics& diagnostics) {
  // The line ends are there for pugixml's sake, which overlooks a '<' as the very last byte.
  std::string buffer(file.content());
  buffer += "\n\n";
  pugi::xml_document parsed;
  const auto result =
      parsed.load_buffer_inplace(buffer.data(), buffer.size(), kParseFlags, pugi::encoding_utf8);
  if (!result) {
    const Explanation explanation = explain(file, result);
    report_references(file, explanation.offset, diagnostics);
    report(file, explanation.offset, explanation.message, diagnostics);
    return {};
  }
  XmlDocument document;
  const Views views(file, parsed.first_child());
  const pugi::xml_node last = parsed.last_child();
  const bool is_padding = last.type() == pugi::node_pcdata && copy(last, views).text.empty();
  if (is_padding) parsed.remove_child(last);
  // Walks without recursion: the depth is the file's to choose.
  std::vector<XmlNode*> parents;
  XmlNode* previous = nullptr;
  for (pugi::xml_node at = parsed.first_child(); at;) {
    XmlNode& node = document.nodes_.emplace_back(copy(at, views));
    if (previous != nullptr) {
      previous->next = &node;
    } else if (!parents.empty()) {
      parents.back()->first_child = &node;
    }
    previous = &node;
    if (at.first_child()) {
      parents.push_back(previous);
      previous = nullptr;
      at = at.first_child();
      continue;
    }
    while (at && !at.next_sibling()) {
      at = at.parent();
      if (parents.empty()) break;
      previous = parents.back();
      parents.pop_back();
    }
    if (at) at = at.next_sibling();
  }
  return document;
}

std::optional<Markup> find_markup(std::string_view content, std::size_t from) {
  static constexpr std::array<std::array<std::string_view, 2>, 3> kSkipped{
      {{"<!--", "-->"}, {"<![CDATA[", "]]>"}, {"<?", "?>"}}};
  Markup markup;
  markup.begin = content.find('<', from);
  if (markup.begin == std::string_view::npos) return {};
  const std::string_view rest = content.substr(markup.begin);
  for (const auto& [opening, closing] : kSkipped) {
    if (!rest.starts_with(opening)) continue;
    const std::size_t end = content.find(closing, markup.begin + opening.size());
    markup.end = end == std::string_view::npos ? end : end + closing.size();
    return markup;
  }
  const std::size_t close = find_tag_end(content, markup.begin + 1);
  markup.end = close == std::string_view::npos ? close : close + 1;
  if (rest.starts_with("<!")) return markup;
  const std::size_t slash = rest.starts_with("</") ? 1 : 0;
  markup.kind = slash == 1 ? Markup::Kind::kClosing
                : close != std::string_view::npos && content[close - 1] == '/'
                    ? Markup::Kind::kEmpty
                    : Markup::Kind::kOpening;
  markup.name = content.substr(markup.begin + 1 + slash, close - markup.begin - 1 - slash);
  markup.name = markup.name.substr(0, markup.name.find_first_of(" \t\r\n/"));
  return markup;
}

std::optional<Outline> outline(std::string_view content) {
  std::optional<Outline> result;
  std::size_t depth = 0;
  for (auto markup = find_markup(content, 0); markup; markup = find_markup(content, markup->end)) {
    if (markup->end == std::string_view::npos) return {};
    if (markup->kind == Markup::Kind::kOther) continue;
    const bool opens = markup->kind != Markup::Kind::kClosing;
    const Extent extent{markup->begin, markup->end, markup->end};
    if (opens && depth == 0) {
      result = Outline{markup->name, extent, {}};
    } else if (opens && depth == 1) {
      result->children.emplace_back(markup->name, extent);
    }
    if (markup->kind == Markup::Kind::kOpening) ++depth;
    if (opens && depth == 0) return result;  // <a/>
    if (opens) continue;
    if (depth == 0) return {};
    --depth;
    if (depth > 1) continue;
    Extent& closed = depth == 0 ? result->extent : result->children.back().second;
    closed.inner_end = markup->begin;
    closed.end = markup->end;
    if (depth == 0) return result;
  }
  return {};
}

std::string_view root_name(std::string_view content) {
  auto markup = find_markup(content, 0);
  while (markup && markup->kind == Markup::Kind::kOther) {
    markup = find_markup(content, markup->end);
  }
  return markup ? markup->name : std::string_view();
}

Location locate(const TextFile& file, const XmlNode& element) {
  return file.locate(file.offset_of(element.text.data()) - 1);
}

bool decode(const TextFile& file, std::string_view written, Text& text, Diagnostics& diagnostics) {
  constexpr std::size_t kLongestReference = 12;
  std::size_t start = file.offset_of(written.data());
  while (!written.empty()) {
    const std::size_t plain = std::min(written.find('&'), written.size());
    text.append(written.substr(0, plain), start);
    start += plain;
    written.remove_prefix(plain);
    if (written.empty()) break;
    const std::size_t end = written.substr(0, kLongestReference).find(';');
    if (end == std::string_view::npos) {
      return report(file, start,
                    "'&' must begin a reference such as &amp;; write &amp; for '&', and in a "
                    "condition the word and",
                    diagnostics);
    }
    const std::string bytes = resolve_reference(written.substr(1, end - 1));
    if (bytes.empty()) {
      return report(file, start,
                    std::string(written.substr(0, end + 1)) +
                        " names no character that a model may have; "
                        "write one of &amp; &lt; &gt; &quot; &apos;, or the character itself",
                    diagnostics);
    }
    text.append_for(bytes, start, end + 1);
    start += end + 1;
    written.remove_prefix(end + 1);
  }
  return true;
}

std::string_view reference_for(char character) {
  switch (character) {
    case '&':
      return "&amp;";
    case '<':
      return "&lt;";
    case '>':
      return "&gt;";
    case '"':
      return "&quot;";
    default:
      return {};
  }
}

std::string escape_xml(std::string_view text) {
  std::string result;
  for (const char each : text) {
    const std::string_view reference = reference_for(each);
    result += reference.empty() ? std::string_view(&each, 1) : reference;
  }
  return result;
}

}  // namespace arbiter::rules
