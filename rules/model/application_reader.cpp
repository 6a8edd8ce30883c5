#include "rules/model/application_reader.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "rules/model/element_reader.hpp"
#include "rules/text/names.hpp"
#include "rules/text/xml.hpp"

namespace arbiter::rules {
namespace {

// Decides in YARP what is Arbiter's to decide; nearly our <arbitration>.
constexpr std::string_view kYarpsArbitrator = "arbitrator";

class ApplicationReader {
 public:
  ApplicationReader(const TextFile& file, Diagnostics& diagnostics)
      : file_(file), diagnostics_(diagnostics) {}

  Application read() {
    if (!read_document()) application_.is_incomplete = true;
    return std::move(application_);
  }

 private:
  bool read_document() {
    if (!check_readable(file_, diagnostics_)) return false;
    const auto document = parse_xml(file_, diagnostics_);
    if (!document) return false;
    const Elements top(document->first());
    if (is_blank(document->first())) {
      diagnostics_.error("empty-file", file_.locate(0),
                         "the file is empty; an application without connections is "
                         "<application/>");
      return false;
    }
    if (top.begin() == top.end()) {
      diagnostics_.error("not-an-application", file_.locate(0),
                         "the file has no element; the root of an application file is "
                         "<application>");
      return false;
    }
    const XmlNode& root = *top.begin();
    if (root.text != "application") {
      diagnostics_.error("not-an-application", locate(file_, root),
                         "the root of an application file is <application>, not <" +
                             std::string(root.text.substr(0, 80)) +
                             (misspelt_for(root.text, {"application"})
                                  ? ">; correct it"
                                  : ">; give a model as a model, not as the application"));
      return false;
    }
    bool fine = true;
    for (const XmlNode& element : Elements(root.first_child)) {
      if (element.text == "connection") fine = read_connection(element) && fine;
      if (element.text == "module") read_module(element);
      if (!warn_if_outside(element)) {
        warn_if_misspelt(element, {"connection", "module", "arbitration"});
      }
    }
    return fine;
  }

  // All that a model has stands in <arbitration>.
  bool warn_if_outside(const XmlNode& element) {
    static const std::set<std::string_view> of_model{"behaviors", "behaviours",    "behavior",
                                                     "behaviour", "meta_behavior", "meta_behaviour",
                                                     "arbiter",   "source",        "define"};
    const auto is_at = [](const XmlAttribute& each) { return each.name == "at"; };
    const bool is_yarps =  // its arbiters name their port in an element
        element.text == "arbiter" &&
        std::none_of(element.attributes.begin(), element.attributes.end(), is_at);
    if (!of_model.contains(element.text) || is_yarps) return false;
    const std::string tag = '<' + std::string(element.text) + '>';
    diagnostics_.warning(
        "misspelt-element", locate(file_, element),
        tag +
            " stands outside <arbitration>, and is passed over with all that "
            "it holds; put " +
            (element.text.starts_with("behavio") && element.text.back() == 's' ? "what it holds"
                                                                               : "it") +
            " into <arbitration>");
    return true;
  }

  // YARP has elements that are not ours; nearly one of ours is most likely that one, and all that
  // it holds would be missing without a word.
  void warn_if_misspelt(const XmlNode& element, const std::vector<std::string_view>& ours) {
    const auto meant = misspelt_for(element.text, ours);
    if (!meant || element.text == kYarpsArbitrator) return;
    const std::string tag = '<' + std::string(element.text) + '>';
    bool is_wrapper = false;
    for (const XmlNode& part : Elements(element.first_child)) {
      is_wrapper = is_wrapper || part.text == *meant;
    }
    diagnostics_.warning(
        "misspelt-element", locate(file_, element),
        tag +
            " is nothing that Arbiter knows in an application, and is passed "
            "over with all that it holds; " +
            (is_wrapper ? "each <" + *meant + "> stands in <application> itself: remove " + tag +
                              " and its end, and leave what it holds"
                        : "did you mean <" + *meant + ">?"));
  }

  static std::optional<std::string> misspelt_for(std::string_view tag,
                                                 const std::vector<std::string_view>& ours) {
    if (std::find(ours.begin(), ours.end(), tag) != ours.end()) return {};
    const auto same = std::find(ours.begin(), ours.end(), lower_case(tag));
    if (same != ours.end()) return std::string(*same);
    auto meant = find_similar(tag, ours);
    // Of short words, with one letter for another, there are too many: <note>, <mode>.
    constexpr std::size_t kShort = 4;
    if (meant && meant->size() <= kShort && meant->size() == tag.size() &&
        !std::is_permutation(tag.begin(), tag.end(), meant->begin())) {
      return {};
    }
    return meant;
  }

  // What a module has already was not misspelt.
  void warn_of_misspelt_parts(const XmlNode& module) {
    std::vector<std::string_view> missing{"name", "node", "prefix", "parameters"};
    for (const XmlNode& child : Elements(module.first_child)) std::erase(missing, child.text);
    for (const XmlNode& child : Elements(module.first_child)) {
      if (!is_part(child.text)) warn_if_misspelt(child, missing);
    }
  }

  static bool is_part(std::string_view tag) {
    return tag == "name" || tag == "node" || tag == "prefix" || tag == "parameters";
  }

  // Of what is not ours nothing is an error: a text that cannot be read tells nothing.
  void read_module(const XmlNode& element) {
    Application::Module module;
    module.where = locate(file_, element);
    for (const XmlNode& child : Elements(element.first_child)) {
      if (child.text == "name") {
        module.name = trim(read_text(child));
      } else if (child.text == "node") {
        module.node = host_of(read_text(child));
      } else if (child.text == "prefix") {
        add_prefix(read_text(child), module.prefixes);
      } else if (child.text == "parameters") {
        const std::string parameters = collapse_blanks(read_text(child)) + " ";
        const std::size_t at = (" " + parameters).find(" --name ");
        if (at == std::string::npos) continue;
        const std::size_t first = at + std::string_view("--name ").size();
        add_prefix(parameters.substr(first, parameters.find(' ', first) - first), module.prefixes);
      }
    }
    warn_of_misspelt_parts(element);
    auto& all = application_.prefixes;
    all.insert(all.end(), module.prefixes.begin(), module.prefixes.end());
    add_prefix(module.name, all);
    if (module.prefixes.empty()) add_prefix(module.name, module.prefixes);
    application_.modules.push_back(std::move(module));
  }

  // YARP's manager takes "/icub1" and "icub1" for one node, and networks take "ICUB1" for the same.
  static std::string host_of(std::string_view text) {
    std::string_view node = trim(text);
    if (!node.empty() && node[0] == '/') node.remove_prefix(1);
    std::string host(node);
    for (char& each : host) {
      if (each >= 'A' && each <= 'Z') each = static_cast<char>(each - 'A' + 'a');
    }
    return host;
  }

  static void add_prefix(std::string_view text, std::vector<std::string>& prefixes) {
    std::string_view prefix = trim(text);
    while (prefix.size() >= 2 && prefix.front() == '"' && prefix.back() == '"') {
      prefix = trim(prefix.substr(1, prefix.size() - 2));
    }
    while (!prefix.empty() && prefix.back() == '/') prefix.remove_suffix(1);
    if (prefix.empty()) return;
    prefixes.push_back((prefix[0] == '/' ? "" : "/") + std::string(prefix));
  }

  std::string read_text(const XmlNode& element) {
    Text text(file_, file_.offset_of(element.text.data()) - 1);
    Diagnostics ignored;
    for (const XmlNode* child = element.first_child; child != nullptr; child = child->next) {
      if (child->kind == XmlKind::kText && !decode(file_, child->text, text, ignored)) return {};
    }
    return text.bytes();
  }

  bool read_connection(const XmlNode& element) {
    const auto source = read_end(element, "from", "output");
    const auto port = read_end(element, "to", "input");
    if (!source || !port) return false;
    const Location where = locate(file_, element);
    const auto [known, is_new] = known_.try_emplace({*source, *port}, where);
    if (is_new) {
      application_.connections.push_back({*source, *port, where});
    } else {
      diagnostics_.note("duplicate-connection", where,
                        "the connection from " + *source + " to " + *port + " exists already, at " +
                            describe(known->second) + "; it counts once, remove one");
    }
    return true;
  }

  // YARP reads the second tag where the first is missing.
  std::optional<std::string> read_end(const XmlNode& connection, std::string_view tag,
                                      std::string_view second_tag) {
    for (const std::string_view each : {tag, second_tag}) {
      for (const XmlNode& element : Elements(connection.first_child)) {
        if (element.text == each) return read_name(element);
      }
    }
    std::string advice = "write the name of a port in it";
    if (ElementReader::has_attribute(connection, tag)) {
      advice = "it is no attribute: write <" + std::string(tag) + ">…</" + std::string(tag) +
               "> between the tags";
    }
    for (const XmlNode& element : Elements(connection.first_child)) {
      if (element.text == "from" || element.text == "to" || !misspelt_for(element.text, {tag})) {
        continue;
      }
      advice = "did you mean it where it has <" + std::string(element.text) + ">?";
    }
    diagnostics_.error("incomplete-connection", locate(file_, connection),
                       "this connection lacks <" + std::string(tag) + ">; " + advice);
    return {};
  }

  std::optional<std::string> read_name(const XmlNode& element) {
    Text text(file_, file_.offset_of(element.text.data()) - 1);
    for (const XmlNode* child = element.first_child; child != nullptr; child = child->next) {
      if (child->kind == XmlKind::kCData) {
        text.append(child->text, file_.offset_of(child->text.data()));
      } else if (child->kind == XmlKind::kText && !decode(file_, child->text, text, diagnostics_)) {
        return {};
      }
    }
    const std::string name(trim(text.bytes()));
    if (name.empty()) {
      diagnostics_.error("incomplete-connection", text.where(),
                         "<" + std::string(element.text) + "> is empty; write the name of a port");
      return {};
    }
    if (auto problem = find_problem_in_foreign_port(name)) {
      diagnostics_.error(std::move(problem->code), text.where(), problem->message);
      return {};
    }
    return name;
  }

  const TextFile& file_;
  Diagnostics& diagnostics_;
  Application application_;
  std::map<std::pair<std::string, std::string>, Location> known_;
};

}  // namespace

Application read_application(const TextFile& file, Diagnostics& diagnostics) {
  return ApplicationReader(file, diagnostics).read();
}

}  // namespace arbiter::rules
