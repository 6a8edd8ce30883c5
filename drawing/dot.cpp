#include "drawing/dot.hpp"

#include "rules/text/xml.hpp"
#include "shm/utf8.hpp"

namespace arbiter::drawing {
namespace {

// Each character of the text; U+FFFD for what cannot be drawn.
template <typename Use>
void for_each_character(std::string_view text, const Use& use) {
  for (std::size_t i = 0; i < text.size();) {
    const shm::Utf8Character character = shm::decode_utf8(text.substr(i));
    const std::size_t length = character.length == 0 ? 1 : character.length;
    const bool is_line_end = text[i] == '\n';
    // Graphviz's reader of labels takes neither control characters nor these two.
    const bool is_none = character.code == 0xfffe || character.code == 0xffff;
    const bool can_be_drawn =
        character.length != 0 && !is_none && (is_line_end || !shm::is_control(character.code));
    use(can_be_drawn ? text.substr(i, length) : std::string_view("\xef\xbf\xbd"));
    i += length;
  }
}

}  // namespace

std::string quoted(std::string_view text) {
  std::string result = "\"";
  for_each_character(text, [&](std::string_view bytes) {
    if (bytes == "\"" || bytes == "\\") {
      result += '\\';
      result += bytes;
    } else if (bytes == "\n") {
      result += "\\n";
    } else if (bytes == "&") {
      result += "&amp;";  // Graphviz takes references in any text
    } else {
      result += bytes;
    }
  });
  return result + '"';
}

std::string html(std::string_view text) {
  std::string result;
  for_each_character(text, [&](std::string_view bytes) {
    if (const auto reference = rules::reference_for(bytes.front()); !reference.empty()) {
      result += reference;
    } else if (bytes == "\n") {
      result += "<BR/>";
    } else {
      result += bytes;
    }
  });
  return result;
}

std::string small(const std::string& content, const char* colour) {
  const std::string attribute = colour == nullptr ? "" : " COLOR=\"" + std::string(colour) + "\"";
  return "<FONT POINT-SIZE=\"9\"" + attribute + ">" + content + "</FONT>";
}

std::string row(const std::string& content) {
  return R"(<TR><TD ALIGN="LEFT">)" + content + "</TD></TR>";
}

std::string html_lines(std::string_view text) {
  static constexpr std::string_view kBreak = "<BR/>", kLeft = "<BR ALIGN=\"LEFT\"/>";
  std::string result = html(text);
  std::size_t at = result.find(kBreak);
  if (at == std::string::npos) return result;
  for (; at != std::string::npos; at = result.find(kBreak, at)) {
    result.replace(at, kBreak.size(), kLeft);
  }
  return result.append(kLeft);
}

std::string place(const rules::Location& where) {
  return where.file + ':' + std::to_string(where.line);
}

void DotWriter::indent() { text_.append(2 * depth_, ' '); }

void DotWriter::open(std::string_view what) {
  indent();
  text_.append(what).append(" {\n");
  ++depth_;
}

void DotWriter::close() {
  --depth_;
  indent();
  text_ += "}\n";
}

void DotWriter::statement(std::string_view what, Attributes attributes) {
  statement(what, std::initializer_list<Attributes>{attributes});
}

void DotWriter::statement(std::string_view what, std::initializer_list<Attributes> lists) {
  indent();
  text_ += what;
  const char* separator = " [";
  for (const Attributes& attributes : lists) {
    for (const auto& [name, value] : attributes) {
      if (value.empty()) continue;
      text_.append(separator).append(name).append("=").append(value);
      separator = " ";
    }
  }
  text_ += separator[1] == '[' ? "\n" : "]\n";
}

void DotWriter::line(LineKind kind, std::string_view what, Attributes attributes) {
  const Line& look = look_of(kind);
  lines_.insert(kind);
  ++line_count_;
  const Attributes of_look{{"color", quoted(look.colour)},
                           {"penwidth", look.width},
                           {"style", look.style},
                           {"arrowhead", look.head}};
  statement(what, {of_look, attributes});
}

void DotWriter::attribute(std::string_view name, std::string_view value) {
  indent();
  text_.append(name).append("=").append(value).append("\n");
}

}  // namespace arbiter::drawing
