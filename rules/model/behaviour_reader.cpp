#include "rules/model/behaviour_reader.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "rules/model/condition_parser.hpp"
#include "rules/text/names.hpp"

namespace arbiter::rules {
namespace {

class BehaviourReader {
 public:
  BehaviourReader(ElementReader& reader, Model& model, Diagnostics& diagnostics)
      : reader_(reader), model_(model), diagnostics_(diagnostics) {}

  void read(const XmlNode& element) {
    behaviour_.is_meta = is_meta_behaviour(element.text);
    if (!reader_.check_attributes(element, {"name"})) doubt_attributes(element);
    // It may be a condition without its tags.
    if (!reader_.check_no_text(element.first_child)) behaviour_.is_incomplete = true;
    read_name(element);
    for (const XmlNode& child : Elements(element.first_child)) {
      if (!read_property(child)) behaviour_.is_incomplete = true;
    }
    if (behaviour_.is_incomplete) model_.lacks_sources = true;
    // What has no name was still checked, but cannot be told from others.
    if (!behaviour_.name.empty()) model_.behaviours.push_back(std::move(behaviour_));
  }

 private:
  // An inhibition that was written as an attribute keeps nobody out.
  void doubt_attributes(const XmlNode& element) {
    for (const XmlAttribute& attribute : element.attributes) {
      if (attribute.name.starts_with("inhibit")) behaviour_.lacks_inhibitions = true;
      if (attribute.name == "condition") behaviour_.is_incomplete = true;
    }
    if (behaviour_.lacks_inhibitions) behaviour_.is_incomplete = true;
  }

  void read_name(const XmlNode& element) {
    const auto written = reader_.attribute(element, "name");
    const auto name = written ? reader_.name(*written, "the name of this behaviour") : std::nullopt;
    if (!name) {
      model_.has_unknown_gaps = model_.lacks_sources = true;
      return;
    }
    behaviour_.name = name->name;
    behaviour_.where = name->where;
    if (auto problem = find_problem_in_behaviour(name->name)) {
      reader_.error(std::move(problem->code), name->where, problem->message);
      refuse_parts_of(name->name);
    }
  }

  // An inhibition that names it takes it apart at its commas.
  void refuse_parts_of(std::string_view name) {
    for (std::size_t first = 0; first <= name.size();) {
      const std::size_t comma = std::min(name.find(',', first), name.size());
      model_.refused_names.insert(collapse_blanks(name.substr(first, comma - first)));
      first = comma + 1;
    }
  }

  // False where something was refused, as in all that follows.
  bool read_property(const XmlNode& element) {
    const bool is_meta = behaviour_.is_meta;
    if (element.text == "condition") return read_own_condition(element);
    if (element.text == "inhibition") {
      const bool fine = read_inhibition(element);
      if (!fine) behaviour_.lacks_inhibitions = true;
      return fine;
    }
    if (element.text == "config" && !is_meta) {
      const bool fine = read_config(element);
      if (!fine) behaviour_.lacks_parts = true;
      return fine;
    }
    if (is_meta && (is_behaviour(element.text) || is_meta_behaviour(element.text))) {
      const bool fine = read_child(element);
      if (!fine) behaviour_.lacks_parts = true;
      return fine;
    }
    behaviour_.lacks_inhibitions = behaviour_.lacks_parts = true;  // it may be any of these
    if (element.text == "config") {
      reader_.error("unknown-element", reader_.where(element),
                    "a meta-behaviour has no <config>, only its behaviours have; move it into "
                    "one of them");
    } else if (is_meta) {
      reader_.report_unknown_element(element, {"behavior", "condition", "inhibition"});
    } else {
      reader_.report_unknown_element(element, {"config", "condition", "inhibition"});
    }
    return false;
  }

  bool read_config(const XmlNode& element) {
    reader_.check_attributes(element, {"at"});
    const auto port = reader_.port_attribute(element, "at");
    const auto text = reader_.text(element);
    const auto source = text ? reader_.port_name(*text, "the output port") : std::nullopt;
    if (!port || !source) return false;
    model_.source_uses.add(*source, kConnected);
    model_.port_uses.add(*port, kConnected);
    behaviour_.configs.push_back(
        {source->name, port->name, reader_.where(element), model_.next_order++});
    return true;
  }

  bool read_child(const XmlNode& element) {
    if (ElementReader::has_attribute(element, "name")) {
      const std::string tag(element.text);
      reader_.error("unknown-attribute", reader_.where(element),
                    "a meta-behaviour names its behaviours, it does not define them; write <" +
                        tag + ">name</" + tag + "> here, and the definition outside");
      refuse(element, model_);
      return false;
    }
    const bool fine = reader_.check_attributes(element, {});
    const auto text = reader_.text(element);
    auto name = text ? reader_.name(*text, "the name of this behaviour") : std::nullopt;
    if (!name) return false;
    behaviour_.children.push_back(std::move(*name));
    return fine;
  }

  bool read_own_condition(const XmlNode& element) {
    const bool fine = reader_.check_attributes(element, {});
    const auto condition = read_condition(element, reader_, model_, diagnostics_);
    if (!condition) return false;
    if (*condition != nullptr) {
      behaviour_.conditions.push_back({*condition, reader_.where(element)});
    }
    return fine;
  }

  bool read_inhibition(const XmlNode& element) {
    bool fine = reader_.check_attributes(element, {});
    const auto text = reader_.text(element);
    if (!text) return false;
    if (text->is_blank()) return fine;
    const std::string& bytes = text->bytes();
    for (std::size_t first = 0; first <= bytes.size();) {
      const std::size_t comma = std::min(bytes.find(',', first), bytes.size());
      std::string name = collapse_blanks(std::string_view(bytes).substr(first, comma - first));
      if (name.empty()) {
        const std::size_t at = comma < bytes.size() ? comma : first - 1;
        reader_.error("empty-name", text->where(at),
                      "a name is missing beside this comma; write it, or remove the comma" +
                          text->origin(at));
        fine = false;
      } else {
        const std::size_t start = bytes.find_first_not_of(" \t\r\n", first);
        behaviour_.inhibitions.push_back({std::move(name), text->where(start)});
      }
      first = comma + 1;
    }
    return fine;
  }

  ElementReader& reader_;
  Model& model_;
  Diagnostics& diagnostics_;
  Behaviour behaviour_;
};

}  // namespace

bool is_behaviour(std::string_view tag) { return tag == "behavior" || tag == "behaviour"; }

bool is_meta_behaviour(std::string_view tag) {
  return tag == "meta_behavior" || tag == "meta_behaviour";
}

void read_behaviour(const XmlNode& element, ElementReader& reader, Model& model,
                    Diagnostics& diagnostics) {
  BehaviourReader(reader, model, diagnostics).read(element);
}

std::optional<ExpressionPtr> read_condition(const XmlNode& element, ElementReader& reader,
                                            Model& model, Diagnostics& diagnostics) {
  const auto text = reader.text(element);
  if (!text) return {};
  if (text->is_blank()) return ExpressionPtr();
  std::vector<Mention> sources, globs;
  auto condition = parse_condition(*text, diagnostics, &sources, &globs);
  for (Mention& glob : globs)
    model.patterns.try_emplace(std::move(glob.name), std::move(glob.where));
  for (const Mention& source : sources) model.source_uses.add(source, kRead);
  return condition;
}

// What stands inside of it is lost as well: behaviours have names there, or whatever else.
void refuse(const XmlNode& element, Model& model) {
  model.lacks_sources = true;
  bool has_name = false;
  std::vector<const XmlNode*> pending{&element};
  while (!pending.empty()) {
    const XmlNode& at = *pending.back();
    pending.pop_back();
    for (const XmlAttribute& attribute : at.attributes) {
      if (attribute.name != "name") continue;
      has_name = true;
      model.refused_names.insert(collapse_blanks(attribute.value));
    }
    if (at.text == "arbiter") model.has_unknown_gaps = true;
    for (const XmlNode& child : Elements(at.first_child)) pending.push_back(&child);
  }
  if (!has_name) model.has_unknown_gaps = true;
}

}  // namespace arbiter::rules
