#include "rules/model/application_writer.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "rules/model/print_rules.hpp"
#include "rules/text/duration.hpp"
#include "rules/text/names.hpp"
#include "rules/text/xml.hpp"
#include "shm/utf8.hpp"

namespace arbiter::rules {
namespace {

constexpr std::string_view kDollar = "dollar";  // the define that "${" in a name is written with

// How the file that the rules go into is written.
struct Style {
  std::string line_end = "\n";
  std::string indent = "  ";
  bool is_utf8 = true;
};

// Whether text can be put in as UTF-8. The declaration, if there is one, comes first.
bool is_utf8(std::string_view content) {
  const bool has_declaration = content.starts_with("<?xml");
  const std::string_view start = content.substr(0, has_declaration ? content.find("?>") : 0);
  if (const std::size_t at = start.find("encoding"); at != std::string_view::npos) {
    const std::string declared = lower_case(start.substr(at, 20));
    if (declared.find("utf-8") == std::string::npos) return false;
  }
  for (std::size_t i = 0; i < content.size();) {
    const std::size_t length = shm::decode_utf8(content.substr(i)).length;
    if (length == 0) return false;
    i += length;
  }
  return true;
}

Style style_of(std::string_view content, const Outline& outline) {
  Style style;
  style.is_utf8 = is_utf8(content);
  if (content.find("\r\n") != std::string_view::npos) style.line_end = "\r\n";
  if (outline.children.empty()) return style;
  const std::size_t child = outline.children.front().second.begin;
  const std::size_t line = content.rfind('\n', child);
  if (line == std::string_view::npos) return style;
  const std::string_view before = content.substr(line + 1, child - line - 1);
  if (!before.empty() && before.find_first_not_of(" \t") == std::string_view::npos) {
    style.indent = before;
  }
  return style;
}

class ArbitrationWriter {
 public:
  ArbitrationWriter(const RuleSet& rules, Style style) : rules_(rules), style_(std::move(style)) {
    for (const BehaviourRules& behaviour : rules.behaviours) {
      for (const auto& [port, rule] : behaviour.rules) {
        behaviours_[{port, rule.source}].push_back(behaviour.name);
      }
    }
  }

  // From <arbitration to its closing tag, to be put where an element may begin.
  std::string write() {
    text_ += "<arbitration timeout=\"" + to_string(rules_.timeout) + "\">";
    line(2, "<!-- Written by arbiter compile: the rules of each input port. -->");
    if (needs_define()) line(2, "<define name=\"" + std::string(kDollar) + "\">$</define>");
    write_sources();
    for (const PortRules& port : rules_.ports) write_port(port);
    line(1, "</arbitration>");
    return std::move(text_);
  }

  // For text in which ${name} is a define's use.
  [[nodiscard]] std::string escape(std::string_view written) const {
    return escape(written, "${" + std::string(kDollar) + '}');
  }
  [[nodiscard]] std::string escape(std::string_view written, std::string_view dollar) const {
    std::string result;
    for (std::size_t i = 0; i < written.size();) {
      const shm::Utf8Character character = shm::decode_utf8(written.substr(i));
      const std::size_t length = std::max<std::size_t>(character.length, 1);
      const std::string_view bytes = written.substr(i, length);
      i += length;
      if (const auto reference = reference_for(bytes.front()); !reference.empty()) {
        result += reference;
      } else if (bytes == "$" && written.substr(i).starts_with('{')) {
        result += dollar;
      } else if (length > 1 && !style_.is_utf8) {
        result += "&#" + std::to_string(character.code) + ';';
      } else {
        result += bytes;
      }
    }
    return result;
  }

  void line(int depth, const std::string& content) {
    text_ += style_.line_end;
    for (; depth > 0; --depth) text_ += style_.indent;
    text_ += content;
  }

 private:
  // Sources that have a T of their own; and those that no rule mentions, which would get lost.
  void write_sources() {
    std::set<std::string> mentioned;
    std::set<const Expression*> seen;
    for (const PortRules& port : rules_.ports) {
      for (const ConnectionRule& rule : port.rules) {
        mentioned.insert(rule.source);
        add_sources_of(*rule.condition, mentioned, seen);
      }
    }
    for (const std::string& source : rules_.sources) {
      const auto timeout = rules_.timeouts.find(source);
      const bool has_timeout = timeout != rules_.timeouts.end();
      if (!has_timeout && mentioned.contains(source)) continue;
      line(2, "<source port=\"" + escape(source) + '"' +
                  (has_timeout ? " timeout=\"" + to_string(timeout->second) + '"' : "") + "/>");
    }
  }

  void write_port(const PortRules& port) {
    line(2, "<arbiter at=\"" + escape(port.port) + '"' +
                (port.first_wins ? " conflict=\"first\">" : ">"));
    for (const ConnectionRule& rule : port.rules) {
      const auto named = behaviours_.find({port.port, rule.source});
      if (named != behaviours_.end()) line(3, comment(named->second));
      line(3,
           "<select from=\"" + escape(rule.source) + "\">" + escape(to_string(rule)) + "</select>");
    }
    line(2, "</arbiter>");
  }

  // Two hyphens would end it. References mean nothing in a comment, so that what the file's
  // encoding may lack becomes a question mark.
  [[nodiscard]] std::string comment(const std::vector<std::string>& names) const {
    std::string text;
    for (const std::string& name : names) {
      if (!text.empty()) text += ", ";
      for (std::size_t i = 0; i < name.size();) {
        const std::size_t length =
            std::max<std::size_t>(shm::decode_utf8(std::string_view(name).substr(i)).length, 1);
        if (name[i] == '-' && text.ends_with('-')) text += ' ';
        text += length > 1 && !style_.is_utf8 ? "?" : name.substr(i, length);
        i += length;
      }
    }
    return "<!-- " + text + " -->";
  }

  [[nodiscard]] bool needs_define() const {
    const auto has_use = [](const std::string& name) {
      return name.find("${") != std::string::npos;
    };
    return std::any_of(rules_.sources.begin(), rules_.sources.end(), has_use) ||
           std::any_of(rules_.ports.begin(), rules_.ports.end(),
                       [&](const PortRules& port) { return has_use(port.port); });
  }

  const RuleSet& rules_;
  const Style style_;
  std::map<std::pair<std::string, std::string>, std::vector<std::string>> behaviours_;
  std::string text_;
};

// An element, and the line that it leaves empty.
Extent with_its_line(std::string_view content, Extent extent) {
  std::size_t begin = extent.begin;
  while (begin > 0 && (content[begin - 1] == ' ' || content[begin - 1] == '\t')) --begin;
  if (begin == 0 || content[begin - 1] != '\n') return extent;
  begin -= begin > 1 && content[begin - 2] == '\r' ? 2 : 1;
  return {begin, extent.end, extent.end};
}

}  // namespace

std::string merge_rules(const RuleSet& rules, std::string_view application) {
  const auto found = outline(application);
  if (!found || found->root != "application") {
    throw std::invalid_argument(
        "the application file is no <application> that rules can be put into");
  }
  const Style style = style_of(application, *found);
  const std::string merged = ArbitrationWriter(rules, style).write();
  const Extent& root = found->extent;

  std::string result;
  std::size_t done = 0;
  bool is_placed = false;
  for (const auto& [name, extent] : found->children) {
    if (name != "arbitration") continue;
    if (!is_placed) {
      result += application.substr(done, extent.begin - done);
      result += merged;
    } else {
      result += application.substr(done, with_its_line(application, extent).begin - done);
    }
    done = extent.end;
    is_placed = true;
  }
  if (is_placed) return result += application.substr(done);

  if (root.inner_end == root.end) {  // <application/>
    result += application.substr(0, application.rfind('/', root.end));
    while (result.ends_with(' ')) result.pop_back();
    result += '>' + style.line_end + style.indent + merged + style.line_end + "</application>";
    return result += application.substr(root.end);
  }
  result += application.substr(0, root.inner_end);
  if (const std::size_t last = result.find_last_not_of(" \t"); result[last] == '\n') {
    result.resize(last + 1);
  } else {
    result += style.line_end;
  }
  result += style.line_end + style.indent + merged + style.line_end;
  return result += application.substr(root.inner_end);
}

bool same_rules(const RuleSet& a, const RuleSet& b) {
  const auto same_rule = [](const ConnectionRule& x, const ConnectionRule& y) {
    return x.source == y.source && to_string(x) == to_string(y);
  };
  const auto same_port = [&](const PortRules& x, const PortRules& y) {
    return x.port == y.port && x.first_wins == y.first_wins &&
           std::equal(x.rules.begin(), x.rules.end(), y.rules.begin(), y.rules.end(), same_rule);
  };
  const auto same_connection = [](const Connection& x, const Connection& y) {
    return x.source == y.source && x.port == y.port;
  };
  return a.timeout == b.timeout && a.timeouts == b.timeouts && a.sources == b.sources &&
         std::equal(a.ports.begin(), a.ports.end(), b.ports.begin(), b.ports.end(), same_port) &&
         std::equal(a.other_connections.begin(), a.other_connections.end(),
                    b.other_connections.begin(), b.other_connections.end(), same_connection);
}

std::string write_application(const RuleSet& rules, std::string_view name) {
  const ArbitrationWriter writer(rules, {});
  std::string text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<application>\n  <name>" +
                     writer.escape(name, "$") + "</name>\n";
  for (const PortRules& port : rules.ports) {
    for (const ConnectionRule& rule : port.rules) {
      text += "\n  <connection>\n    <from>" + writer.escape(rule.source, "$") +
              "</from>\n    <to>" + writer.escape(port.port, "$") + "</to>\n  </connection>";
    }
  }
  return merge_rules(rules, text + "\n</application>\n");
}

}  // namespace arbiter::rules
