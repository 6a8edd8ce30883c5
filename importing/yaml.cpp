#include "importing/yaml.hpp"

#include <yaml.h>

#include <algorithm>
#include <cstdint>
#include <set>
#include <utility>

#include "rules/text/names.hpp"

namespace arbiter::importing {
namespace {

// Of each character of a text its first byte, and behind the last one the end.
std::vector<std::uint32_t> character_starts(std::string_view text) {
  std::vector<std::uint32_t> starts;
  starts.reserve(text.size() + 1);
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool continues = (static_cast<unsigned char>(text[i]) >> 6) == 0b10;
    if (!continues) starts.push_back(static_cast<std::uint32_t>(i));
  }
  starts.push_back(static_cast<std::uint32_t>(text.size()));
  return starts;
}

std::string bytes_of(const yaml_char_t* text, std::size_t length) {
  return {reinterpret_cast<const char*>(text), length};
}

class Reader {
 public:
  Reader(const rules::TextFile& file, rules::Diagnostics& diagnostics)
      : file_(file), diagnostics_(diagnostics), starts_(character_starts(file.content())) {
    if (yaml_parser_initialize(&parser_) == 0) throw std::bad_alloc();
    yaml_parser_set_encoding(&parser_, YAML_UTF8_ENCODING);
    yaml_parser_set_input_string(&parser_,
                                 reinterpret_cast<const unsigned char*>(file.content().data()),
                                 file.content().size());
  }
  ~Reader() {
    yaml_event_delete(&event_);
    yaml_parser_delete(&parser_);
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  std::optional<YamlNode> document() {
    if (has_many_tag_directives()) return {};
    if (!next() || !next()) return {};  // the stream's start is behind us
    if (event_.type == YAML_STREAM_END_EVENT) return refuse("the file is empty; nothing to import");
    if (!next()) return {};
    auto root = node(0);
    if (!root || !next() || !next()) return {};  // the document's end, and what follows it
    if (event_.type == YAML_STREAM_END_EVENT) return root;
    return refuse("a second document begins here; give each a file of its own");
  }

 private:
  // libyaml compares each with all before it; and there is no tag that they could be for.
  bool has_many_tag_directives() {
    constexpr int kMost = 10;
    std::size_t at = std::string_view::npos;
    for (int i = 0; i <= kMost; ++i) {
      at = file_.content().find("%TAG", at + 1);
      if (at == std::string_view::npos) return false;
    }
    error(file_.locate(at),
          "the file has more than " + std::to_string(kMost) + " times %TAG; remove all of them");
    return true;
  }

  bool next() {
    yaml_event_delete(&event_);
    if (yaml_parser_parse(&parser_, &event_) != 0) return true;
    const char* problem = parser_.problem != nullptr ? parser_.problem : "it cannot be read";
    // The reader, below the parser, knows a byte; the others know a mark.
    const rules::Location where = parser_.error == YAML_READER_ERROR
                                      ? file_.locate(parser_.problem_offset)
                                      : locate(parser_.problem_mark);
    const bool is_tab =
        parser_.error == YAML_SCANNER_ERROR && byte_at(parser_.problem_mark) == '\t';
    error(where, is_tab ? "a tab is no indentation in YAML; write blanks"
                        : "this is no YAML: " + std::string(problem) + "; correct it");
    return false;
  }

  std::optional<YamlNode> node(int depth) {
    if (++nodes_ > kMaxYamlNodes) {
      return refuse("the file has more than " + std::to_string(kMaxYamlNodes) +
                    " values; import the part of it that configures the multiplexer");
    }
    if (depth > kMaxYamlDepth) {
      return refuse("values are nested more than " + std::to_string(kMaxYamlDepth) +
                    " deep here; import the part that configures the multiplexer");
    }
    switch (event_.type) {
      case YAML_SCALAR_EVENT:
        return scalar();
      case YAML_SEQUENCE_START_EVENT:
        return sequence(depth);
      case YAML_MAPPING_START_EVENT:
        return map(depth);
      default:
        return refuse("an alias refers to what stands elsewhere; write it out here");
    }
  }

  std::optional<YamlNode> scalar() {
    const auto& scalar = event_.data.scalar;
    if (scalar.tag != nullptr) return refuse_tag();
    YamlNode result = begin(YamlNode::Kind::kScalar);
    result.text = bytes_of(scalar.value, scalar.length);
    result.is_plain = scalar.style == YAML_PLAIN_SCALAR_STYLE;
    return result;
  }

  std::optional<YamlNode> sequence(int depth) {
    if (event_.data.sequence_start.tag != nullptr) return refuse_tag();
    YamlNode result = begin(YamlNode::Kind::kSequence);
    while (next()) {
      if (event_.type == YAML_SEQUENCE_END_EVENT) return result;
      auto item = node(depth + 1);
      if (!item) return {};
      result.items.push_back(std::move(*item));
    }
    return {};
  }

  std::optional<YamlNode> map(int depth) {
    if (event_.data.mapping_start.tag != nullptr) return refuse_tag();
    YamlNode result = begin(YamlNode::Kind::kMap);
    std::set<std::string> keys;
    while (next()) {
      if (event_.type == YAML_MAPPING_END_EVENT) return result;
      if (event_.type != YAML_SCALAR_EVENT) {
        return refuse("a key is a list or a map here; a parameter's name is a word");
      }
      auto key = node(depth + 1);
      if (!key) return {};
      if (key->text == "<<" && key->is_plain) {
        return refuse("a merge key takes values from elsewhere; write them out here");
      }
      if (!keys.insert(key->text).second) {
        return refuse("the key " + rules::quote(key->text) + " is given twice; remove one");
      }
      if (!next()) return {};
      auto value = node(depth + 1);
      if (!value) return {};
      result.entries.push_back({std::move(*key), std::move(*value)});
    }
    return {};
  }

  [[nodiscard]] YamlNode begin(YamlNode::Kind kind) const {
    YamlNode result;
    result.kind = kind;
    result.where = locate(event_.start_mark);
    return result;
  }

  // libyaml counts characters, we count bytes.
  [[nodiscard]] std::size_t offset_of(const yaml_mark_t& mark) const {
    return starts_[std::min(mark.index, starts_.size() - 1)];
  }
  [[nodiscard]] rules::Location locate(const yaml_mark_t& mark) const {
    return file_.locate(offset_of(mark));
  }
  // At the end of the file: NUL.
  [[nodiscard]] char byte_at(const yaml_mark_t& mark) const {
    const std::size_t offset = offset_of(mark);
    return offset < file_.content().size() ? file_.content()[offset] : '\0';
  }

  std::nullopt_t refuse_tag() {
    return refuse("a tag says here how to read a value; write the value as it is meant");
  }

  std::nullopt_t refuse(const std::string& message) {
    error(locate(event_.start_mark), message);
    return std::nullopt;
  }

  void error(const rules::Location& where, const std::string& message) {
    diagnostics_.error("invalid-yaml", where, message);
  }

  const rules::TextFile& file_;
  rules::Diagnostics& diagnostics_;
  const std::vector<std::uint32_t> starts_;
  yaml_parser_t parser_{};
  yaml_event_t event_{};
  std::size_t nodes_ = 0;
};

}  // namespace

bool YamlNode::is_null() const {
  return is_scalar() && is_plain && (text.empty() || text == "~" || text == "null");
}

const YamlEntry* YamlNode::find(std::string_view key) const {
  const auto found = std::find_if(entries.begin(), entries.end(),
                                  [&](const YamlEntry& entry) { return entry.key.text == key; });
  return found == entries.end() ? nullptr : &*found;
}

std::optional<YamlNode> parse_yaml(const rules::TextFile& file, rules::Diagnostics& diagnostics) {
  if (!rules::check_size(file, kMaxYamlBytes, diagnostics)) return {};
  if (!rules::check_characters(file, diagnostics)) return {};
  return Reader(file, diagnostics).document();
}

}  // namespace arbiter::importing
