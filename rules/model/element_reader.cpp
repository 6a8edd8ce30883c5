#include "rules/model/element_reader.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "rules/text/names.hpp"

namespace arbiter::rules {
namespace {

std::string in_brackets(const XmlNode& element) {
  return '<' + std::string(element.text.substr(0, 80)) + '>';
}

std::string list(KnownNames names, std::string_view before, std::string_view after) {
  std::string result;
  for (const auto* name = names.begin(); name != names.end(); ++name) {
    if (name != names.begin()) result += name + 1 == names.end() ? " or " : ", ";
    result += std::string(before) + std::string(*name) + std::string(after);
  }
  return result;
}

// "; did you mean …?", else what there is to choose from.
std::string propose(std::string_view name, KnownNames known, std::string_view before,
                    std::string_view after) {
  if (known.size() == 0) return "; remove it";
  auto similar = find_similar(name, std::vector<std::string_view>(known));
  // "inhibit", "configuration"
  constexpr std::size_t kLeast = 4;
  for (const std::string_view each : known) {
    const bool is_begun = name.size() >= kLeast && each.starts_with(name);
    if (!similar && (is_begun || name.starts_with(each))) similar = std::string(each);
  }
  if (similar) {
    return "; did you mean " + std::string(before) + *similar + std::string(after) + "?";
  }
  return "; it takes " + list(known, before, after);
}

bool contains(KnownNames names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// Of the elements of a gateway's mapping, which are read here, too.
bool is_of_mapping(std::string_view element) {
  return contains({"in", "out", "gateway", "gateways"}, element);
}

// What belongs elsewhere, or is called otherwise. Other multiplexers give a timeout and a priority
// to whoever commands. Empty: nothing is known of it.
std::string_view advice_on(std::string_view attribute, std::string_view element, KnownNames known) {
  if (attribute == "timeout" || attribute == "time") {
    if (contains(known, "timeout")) return "did you mean timeout?";
    if (element == "in") {
      return "the model says how long a source stays active: write <source port=\"…\" "
             "timeout=\"…\"/> there";
    }
    if (is_of_mapping(element)) return {};
    return "a source has one: write <source port=\"…\" timeout=\"…\"/> beside the behaviours of "
           "the model";
  }
  if (attribute == "priority") {
    if (element == "select" || element == "arbiter") {
      return "write <arbiter at=\"…\" conflict=\"first\">, so that the first <select> in it "
             "wins, or let the conditions exclude each other";
    }
    if (is_of_mapping(element)) {
      return "the model decides who wins: name there those that a behaviour keeps out in its "
             "<inhibition>";
    }
    return "in the model name those that a behaviour keeps out in its <inhibition>, or write "
           "<arbiter at=\"…\" conflict=\"first\"/>, so that the first in the file wins";
  }
  if (contains({"behavior", "behaviour", "meta_behavior", "meta_behaviour"}, element)) {
    if (attribute.starts_with("inhibit")) {
      return "write <inhibition>…</inhibition> between its tags, with the names of those that it "
             "keeps out";
    }
    if (attribute == "condition") return "write <condition>…</condition> between its tags";
  }
  if (element == "define" && attribute == "value") {
    return "write the value between the tags: <define name=\"…\">…</define>";
  }
  if (element == "config" && attribute == "from") {
    return "write the output port between the tags: <config at=\"…\">…</config>";
  }
  if (element == "config" && (attribute == "to" || attribute == "port")) return "did you mean at?";
  if (element == "arbiter" && (attribute == "port" || attribute == "to")) return "did you mean at?";
  if (element == "select" && contains({"when", "if", "condition"}, attribute)) {
    return "write the condition between the tags: <select from=\"…\">…</select>";
  }
  if (element == "select" && (attribute == "to" || attribute == "at")) {
    return "the <arbiter at=\"…\"> around it says where";
  }
  return {};
}

// Of an element that is no other's. Empty: nothing is known of it.
std::string_view advice_on_element(std::string_view name, KnownNames known) {
  if (name == "priority" && contains(known, "select")) return advice_on(name, "select", known);
  if (name == "timeout" || name == "priority") return advice_on(name, "", known);
  if (!contains(known, "inhibition")) return {};
  if (name == "name") return "it is an attribute: <behavior name=\"…\">";
  if (name == "inhibits") return "did you mean <inhibition>?";
  if (name.starts_with("inhibited")) {
    return "an <inhibition> stands in the behaviour that inhibits, and names those that it keeps "
           "out";
  }
  return {};
}

// Of one inside an element that takes text only.
std::string_view advice_on_part(std::string_view part, std::string_view element) {
  if (part == "priority") return advice_on(part, element, {});
  if (element == "config" && contains({"from", "to", "at"}, part)) {
    return "write <config at=\"…\">…</config>, with the input port in the attribute at, and the "
           "output port between the tags";
  }
  return {};
}

constexpr std::string_view kNoInclude =
    "no file includes another; give all files of a model together, as in `arbiter check robot.xml "
    "arm.xml` and `arbiterd --model robot.xml arm.xml`, and all mappings to the gateway";

}  // namespace

bool ElementReader::check_attributes(const XmlNode& element, KnownNames known) {
  bool fine = true;
  for (std::size_t i = 0; i < element.attributes.size(); ++i) {
    const XmlAttribute& attribute = element.attributes[i];
    const Location where = file_.locate(file_.offset_of(attribute.name.data()));
    if (!contains(known, attribute.name)) {
      error("unknown-attribute", where, [&] {
        const std::string_view better = advice_on(attribute.name, element.text, known);
        return in_brackets(element) + " has no attribute " + quote(attribute.name) +
               (better.empty() ? propose(attribute.name, known, "", "")
                               : "; " + std::string(better));
      });
      fine = false;
      continue;
    }
    const auto* first = element.attributes.data();
    while (first->name != attribute.name) ++first;
    if (first != &attribute) {
      error("duplicate-attribute", where,
            "the attribute " + quote(attribute.name) + " occurs twice; remove one");
      fine = false;
    }
  }
  return fine;
}

bool ElementReader::has_attribute(const XmlNode& element, std::string_view name) {
  return std::any_of(element.attributes.begin(), element.attributes.end(),
                     [&](const XmlAttribute& attribute) { return attribute.name == name; });
}

std::optional<Text> ElementReader::optional_attribute(const XmlNode& element,
                                                      std::string_view name) {
  for (const XmlAttribute& attribute : element.attributes) {
    if (attribute.name != name) continue;
    const std::size_t start = file_.offset_of(attribute.value.data());
    const std::size_t tag = attribute.value.find('<');
    if (tag != std::string_view::npos) {
      error("malformed-xml", file_.locate(start + tag),
            "'<' must not stand in an attribute; write &lt;, or close the attribute before it");
      return {};
    }
    Text text(file_, start);
    if (!decode(file_, attribute.value, text, diagnostics_)) return {};
    return defines_.expand(text, diagnostics_);
  }
  return {};
}

std::optional<Text> ElementReader::attribute(const XmlNode& element, std::string_view name) {
  if (!has_attribute(element, name)) {
    error("missing-attribute", where(element), [&] {
      return in_brackets(element) + " lacks the attribute " + std::string(name) + "; write " +
             std::string(name) + "=\"…\"";
    });
    return {};
  }
  return optional_attribute(element, name);
}

std::optional<Text> ElementReader::text(const XmlNode& element) {
  Text text(file_, file_.offset_of(element.text.data()) - 1);
  bool fine = true;
  for (const XmlNode* child = element.first_child; child != nullptr; child = child->next) {
    if (child->kind == XmlKind::kElement) {
      error("unknown-element", where(*child), [&] {
        const std::string_view better = advice_on_part(child->text, element.text);
        return in_brackets(element) + " takes text only, no " + in_brackets(*child) + "; " +
               (better.empty() ? "remove it, or close " + in_brackets(element) + " before it"
                               : std::string(better));
      });
      return {};
    }
    if (child->kind == XmlKind::kCData) {
      text.append(child->text, file_.offset_of(child->text.data()));
    } else {
      fine = decode(file_, child->text, text, diagnostics_) && fine;
    }
  }
  if (!fine) return {};
  return defines_.expand(text, diagnostics_);
}

bool ElementReader::check_no_text(const XmlNode* first_child) {
  bool fine = true;
  for (const XmlNode* child = first_child; child != nullptr; child = child->next) {
    if (child->kind == XmlKind::kElement || trim(child->text).empty()) continue;
    const std::string_view text = trim(child->text);
    error("stray-text", file_.locate(file_.offset_of(text.data())),
          "the text " + quote(text.substr(0, text.find_first_of("\r\n"))) +
              " belongs to no element; remove it, or put it into one");
    fine = false;
  }
  return fine;
}

void ElementReader::report_unknown_element(const XmlNode& element, KnownNames known) {
  error("unknown-element", where(element), [&] {
    const bool is_include = element.text == "include" || element.text.ends_with(":include");
    if (is_include) return std::string(kNoInclude);
    if (contains(known, "config") && find_similar(element.text, {"connection"})) {
      return in_brackets(element) +
             " is not known here; write a connection as <config at=\"…\">…</config>";
    }
    if (contains(known, "behavior") && find_similar(element.text, {"connection"})) {
      return in_brackets(element) +
             " is not known here; a behaviour has the connections that it needs, as <config "
             "at=\"…\">…</config>";
    }
    const std::string_view better = advice_on_element(element.text, known);
    return in_brackets(element) + " is not known here" +
           (better.empty() ? propose(element.text, known, "<", ">") : "; " + std::string(better));
  });
}

std::optional<Mention> ElementReader::port_name(const Text& text, std::string_view what) {
  const std::string_view name = trim(text.bytes());
  if (name.empty()) {
    error("empty-name", text.where(), std::string(what) + " is empty; write a port's name");
    return {};
  }
  const auto start = static_cast<std::size_t>(name.data() - text.bytes().data());
  if (auto problem = find_problem_in_port(name)) {
    const std::size_t at = start + problem->at;
    const std::string define = text.define_of(start, start + name.size());
    if (define.empty() || defines_.tells_fault_of(define)) {
      error(std::move(problem->code), text.where(at), problem->message + text.origin(at));
    }
    return {};
  }
  return Mention{std::string(name), text.where(start), text.define_of(start, start + name.size())};
}

std::optional<Mention> ElementReader::port_attribute(const XmlNode& element,
                                                     std::string_view name) {
  const auto text = attribute(element, name);
  if (!text) return {};
  return port_name(*text, "the attribute " + quote(name));
}

std::optional<Mention> ElementReader::name(const Text& text, std::string_view what) {
  std::string name = collapse_blanks(text.bytes());
  if (name.empty()) {
    error("empty-name", text.where(), std::string(what) + " is empty; write a name");
    return {};
  }
  return Mention{std::move(name), text.where()};
}

bool is_blank(const XmlNode* first) {
  for (const XmlNode* node = first; node != nullptr; node = node->next) {
    if (!trim(node->text).empty()) return false;
  }
  return true;
}

}  // namespace arbiter::rules
