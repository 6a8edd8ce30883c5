#include "rules/model/model_reader.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "rules/model/behaviour_reader.hpp"
#include "rules/model/element_reader.hpp"
#include "rules/text/duration.hpp"
#include "rules/text/names.hpp"
#include "rules/text/xml.hpp"

namespace arbiter::rules {
namespace {

constexpr std::string_view kApplication = "application";
constexpr std::string_view kArbitration = "arbitration";

bool is_root(std::string_view tag) { return tag == "behaviors" || tag == "behaviours"; }

class ModelReader {
 public:
  ModelReader(const TextFile& file, Defines& defines, Model& model, Diagnostics& diagnostics)
      : file_(file),
        defines_(defines),
        model_(model),
        diagnostics_(diagnostics),
        reader_(file, defines, diagnostics) {}

  bool read() {
    const auto document = check_bytes() ? parse_xml(file_, diagnostics_) : std::nullopt;
    if (!document) return give_up();
    return read_tree(*document);
  }

 private:
  bool read_tree(const XmlDocument& document) {
    const Elements top(document.first());
    if (is_blank(document.first())) {
      diagnostics_.error("empty-file", file_.locate(0),
                         "the file is empty; a model without rules is <behaviors/>");
      return give_up();
    }
    if (top.begin() != top.end() && is_root((*top.begin()).text)) {
      read_document(document);
    } else if (top.begin() != top.end() && is_application(*top.begin())) {
      read_arbitration(*top.begin());
      return true;
    } else {
      read_list(document.first());
    }
    return false;
  }

  // Of an application only the model in it is ours to judge.
  bool check_bytes() {
    const bool is_application = root_name(file_.content()) == kApplication;
    const auto written = is_application ? outline(file_.content()) : std::nullopt;
    if (!written) return check_characters(file_, diagnostics_);
    if (!check_readable(file_, diagnostics_)) return false;
    for (const auto& [name, extent] : written->children) {
      if (name != kArbitration) continue;
      if (!check_characters(file_, diagnostics_, extent.begin, extent.end)) return false;
    }
    return true;
  }

  static bool is_application(const XmlNode& root) {
    if (root.text != kApplication) return false;
    for (const XmlNode& element : Elements(root.first_child)) {
      if (element.text == kArbitration) return true;
    }
    return false;
  }

  // The rules that arbiter compile has merged into an application, or whatever model somebody has
  // put there. The rest of the file is the application's.
  void read_arbitration(const XmlNode& application) {
    const XmlNode* first = nullptr;
    for (const XmlNode& element : Elements(application.first_child)) {
      if (element.text != kArbitration) continue;
      if (first != nullptr) {
        reader_.error("duplicate-arbitration", reader_.where(element),
                      "the application has its model already, at " +
                          describe(reader_.where(*first)) + "; remove one of the two");
        model_.has_unknown_gaps = model_.lacks_sources = true;
        return;
      }
      first = &element;
      read_root(element);
    }
  }

  bool give_up() {
    model_.has_unknown_gaps = model_.lacks_sources = true;
    defines_.expect_gaps();
    return false;
  }

  void read_document(const XmlDocument& document) {
    reader_.check_no_text(document.first());
    Elements::Iterator at = Elements(document.first()).begin();
    const XmlNode& root = *at;
    read_root(root);
    for (const Elements::Iterator end(nullptr); ++at != end;) {
      reader_.error("unknown-element", reader_.where(*at),
                    "<" + std::string((*at).text) + "> stands behind the root; move it into <" +
                        std::string(root.text) + ">");
      refuse(*at, model_);
    }
  }

  void read_root(const XmlNode& root) {
    reader_.check_attributes(root, {"timeout"});
    if (const auto text = reader_.optional_attribute(root, "timeout")) read_root_timeout(*text);
    is_in_root_ = true;
    read_list(root.first_child);
  }

  void read_root_timeout(const Text& text) {
    const auto value = read_duration(text);
    if (!value) return;
    if (!model_.timeout) {
      model_.timeout = {*value, text.where()};
    } else if (model_.timeout->value != *value) {
      reader_.error("conflicting-timeout", text.where(),
                    "the model's timeout is another one at " + describe(model_.timeout->where) +
                        "; keep one of them");
    }
  }

  void read_list(const XmlNode* first) {
    reader_.check_no_text(first);
    announce_defines(first);
    for (const XmlNode& element : Elements(first)) {
      if (element.text == "define") {
        read_define(element);
      } else if (element.text == "source") {
        read_source(element);
      } else if (is_behaviour(element.text) || is_meta_behaviour(element.text)) {
        read_behaviour(element, reader_, model_, diagnostics_);
      } else if (element.text == "arbiter") {
        read_arbiter(element);
      } else {
        report_unknown(element);
      }
    }
  }

  void report_unknown(const XmlNode& element) {
    refuse(element, model_);
    if (element.text == "application") {
      reader_.error("unknown-element", reader_.where(element),
                    "this is an application file, not a model, because it has no <arbitration>; " +
                        advice_on_application(element));
    } else if (!is_in_root_ && find_similar(element.text, {kApplication})) {
      reader_.report_unknown_element(element, {kApplication});
    } else if (is_root(element.text)) {
      reader_.error("unknown-element", reader_.where(element),
                    "<" + std::string(element.text) +
                        "> is a root; put it around everything, or leave it away");
    } else if (is_in_root_) {
      reader_.report_unknown_element(element,
                                     {"define", "source", "behavior", "meta_behavior", "arbiter"});
    } else {
      reader_.report_unknown_element(
          element, {"behaviors", "define", "source", "behavior", "meta_behavior", "arbiter"});
    }
  }

  static std::string advice_on_application(const XmlNode& application) {
    for (const XmlNode& element : Elements(application.first_child)) {
      if (!find_similar(element.text, {kArbitration})) continue;
      return "did you mean that where it has <" + std::string(element.text) + ">?";
    }
    return "give it with --application";
  }

  void announce_defines(const XmlNode* first) {
    has_only_defines_ = true;
    for (const XmlNode& element : Elements(first)) {
      if (element.text != "define") {
        has_only_defines_ = false;
        continue;
      }
      for (const XmlAttribute& attribute : element.attributes) {
        if (attribute.name == "name") {
          defines_.announce(collapse_blanks(attribute.value), reader_.where(element));
        }
      }
    }
  }

  void read_define(const XmlNode& element) {
    reader_.check_attributes(element, {"name"});
    const auto written = reader_.attribute(element, "name");
    const auto name = written ? reader_.name(*written, "the name of a define") : std::nullopt;
    const auto text = reader_.text(element);
    if (!name) return defines_.expect_gaps();
    if (name->name.find_first_of("{}$") != std::string::npos) {
      reader_.error("invalid-name", name->where,
                    "the name of a define has none of the characters $ { }; rename it");
    }
    // Trimmed, so that ${a}${b} can make one name.
    std::optional<std::string> value;
    if (text) value = std::string(trim(text->bytes()));
    // A file of defines alone offers them to several models.
    if (!defines_.add(name->name, std::move(value), name->where, has_only_defines_)) {
      reader_.error("duplicate-define", name->where,
                    "the define " + quote(name->name) + " exists already, at " +
                        describe(*defines_.find(name->name)) + "; rename or remove one");
    }
  }

  void read_source(const XmlNode& element) {
    reader_.check_attributes(element, {"port", "timeout"});
    reader_.check_no_text(element.first_child);
    for (const XmlNode& child : Elements(element.first_child)) {
      reader_.report_unknown_element(child, {});
    }
    const auto port = reader_.port_attribute(element, "port");
    const auto text = reader_.optional_attribute(element, "timeout");
    const auto timeout = text ? read_duration(*text) : std::nullopt;
    if (!port) {
      model_.lacks_sources = true;
      return;
    }
    model_.source_uses.add(*port, kDeclared);
    model_.sources.push_back({port->name, reader_.where(element), timeout});
  }

  std::optional<shm::Nanoseconds> read_duration(const Text& text) {
    ParsedDuration parsed = parse_duration(trim(text.bytes()));
    if (parsed.problem.empty()) return parsed.value;
    reader_.error("invalid-timeout", text.where(), parsed.problem + text.origin(0));
    return {};
  }

  void read_arbiter(const XmlNode& element) {
    Arbiter arbiter;
    const bool has_known_attributes = reader_.check_attributes(element, {"at", "conflict"});
    const bool has_no_text = reader_.check_no_text(element.first_child);
    arbiter.is_incomplete = !has_known_attributes || !has_no_text;
    const auto port = reader_.port_attribute(element, "at");
    arbiter.where = reader_.where(element);
    if (ElementReader::has_attribute(element, "conflict") && !read_conflict(element, arbiter)) {
      arbiter.is_incomplete = true;
    }
    for (const XmlNode& child : Elements(element.first_child)) {
      if (child.text == "select") {
        if (!read_select(child, port)) arbiter.is_incomplete = true;
      } else {
        arbiter.is_incomplete = true;
        reader_.report_unknown_element(child, {"select"});
      }
    }
    if (arbiter.is_incomplete || !port) model_.lacks_sources = true;
    if (!port) {
      model_.lacks_arbiters = true;
      return;
    }
    const bool has_rules = Elements(element.first_child).begin() != Elements(nullptr).begin();
    model_.port_uses.add(*port, has_rules ? kConnected : kDeclared);
    arbiter.port = port->name;
    model_.arbiters.push_back(std::move(arbiter));
  }

  bool read_conflict(const XmlNode& element, Arbiter& arbiter) {
    const auto text = reader_.optional_attribute(element, "conflict");
    if (!text) return false;
    const std::string_view value = trim(text->bytes());
    arbiter.first_wins = value == "first";
    if (!arbiter.first_wins) {
      reader_.error("invalid-conflict", text->where(),
                    "conflict=" + quote(value) +
                        " is not known; write conflict=\"first\", or "
                        "leave it out, so that conflicts are errors");
    }
    return arbiter.first_wins;
  }

  bool read_select(const XmlNode& element, const std::optional<Mention>& port) {
    reader_.check_attributes(element, {"from"});
    const auto source = reader_.port_attribute(element, "from");
    const auto condition = read_condition(element, reader_, model_, diagnostics_);
    if (!port || !source || !condition) return false;
    model_.source_uses.add(*source, kConnected);
    model_.selects.push_back({source->name, port->name,
                              *condition ? *condition : make_constant(true), reader_.where(element),
                              model_.next_order++});
    return true;
  }

  const TextFile& file_;
  Defines& defines_;
  Model& model_;
  Diagnostics& diagnostics_;
  ElementReader reader_;
  bool is_in_root_ = false;
  bool has_only_defines_ = false;
};

}  // namespace

bool read_model(const TextFile& file, Defines& defines, Model& model, Diagnostics& diagnostics) {
  return ModelReader(file, defines, model, diagnostics).read();
}

}  // namespace arbiter::rules
