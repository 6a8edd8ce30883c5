#include "gateway/mapping/read_mapping.hpp"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "gateway/mapping/attributes.hpp"
#include "gateway/mapping/entry_reader.hpp"
#include "rules/model/element_reader.hpp"
#include "rules/text/defines.hpp"
#include "rules/text/names.hpp"
#include "rules/text/xml.hpp"

namespace arbiter::gateway {
namespace {

using rules::Elements;
using rules::XmlNode;

constexpr std::size_t kMaxConfigurationBytes = std::size_t{1} << 20;

class MappingReader {
 public:
  MappingReader(const rules::TextFile& file, rules::Diagnostics& diagnostics,
                const std::string* directory, const ReadFile& read_file)
      : file_(file),
        diagnostics_(diagnostics),
        directory_(directory),
        read_file_(read_file),
        reader_(file, defines_, diagnostics) {
    mapping_.path = file.path();
  }

  Mapping read() {
    if (!rules::check_characters(file_, diagnostics_)) return std::move(mapping_);
    const auto document = rules::parse_xml(file_, diagnostics_);
    if (!document) return std::move(mapping_);
    const Elements top(document->first());
    if (top.begin() == top.end()) {
      reader_.error("empty-file", file_.locate(0),
                    "the file has no <gateway>; write <gateway kind=\"dds\"> or "
                    "<gateway kind=\"iceoryx\">, with <in …/> and <out …/> in it");
      return std::move(mapping_);
    }
    reader_.check_no_text(document->first());
    const XmlNode& root = *top.begin();
    if (root.text == "gateways") {
      reader_.check_attributes(root, {});
      reader_.check_no_text(root.first_child);
      read_gateways(root.first_child);
      Elements::Iterator behind = top.begin();
      if (++behind != top.end()) {
        reader_.error("unknown-element", reader_.where(*behind),
                      "<" + std::string((*behind).text.substr(0, 80)) +
                          "> stands behind the root; move it into <gateways>");
      }
    } else {
      read_gateways(document->first());
    }
    return std::move(mapping_);
  }

 private:
  void read_gateways(const XmlNode* first) {
    for (const XmlNode& element : Elements(first)) {
      if (element.text == "gateway") {
        read_gateway(element);
      } else {
        reader_.report_unknown_element(element, {"gateway"});
      }
    }
  }

  void read_gateway(const XmlNode& element) {
    Attributes attributes(reader_, element);
    Gateway gateway;
    gateway.where = reader_.where(element);
    attributes.required("kind", 100);
    const auto kind =
        attributes.word<Kind>("kind", {{"dds", Kind::kDds}, {"iceoryx", Kind::kIceoryx}});
    if (!kind) return;  // what the others mean depends on it
    gateway.kind = *kind;
    if (*kind == Kind::kDds) {
      reader_.check_attributes(element, {"kind", "domain", "interface", "peers", "configuration"});
      if (const auto domain = attributes.number("domain", 0, kMaxDomain)) {
        gateway.domain = static_cast<std::uint32_t>(*domain);
      }
      gateway.interfaces = attributes.list("interface", 255);
      refuse_twice(attributes, gateway.interfaces);
      gateway.peers = attributes.list("peers", 255);
      refuse_no_hosts(attributes, gateway.peers);
      if (const auto file = attributes.text("configuration", 4096)) {
        gateway.configuration = path_of(*file);
        gateway.configuration_text = read_configuration(attributes, gateway.configuration);
      }
    } else {
      reader_.check_attributes(element, {"kind"});
    }
    reader_.check_no_text(element.first_child);
    const EntryContext context{*kind, directory_, read_file_};
    bool is_other_kind = false;
    for (const XmlNode& child : Elements(element.first_child)) {
      if (child.text != "in" && child.text != "out") {
        reader_.report_unknown_element(child, {"in", "out"});
        continue;
      }
      if (++entries_ > kMaxEntries) {
        if (entries_ == kMaxEntries + 1) {
          reader_.error("too-many-entries", reader_.where(child),
                        "a mapping has at most " + std::to_string(kMaxEntries) +
                            " entries; split it over several files");
        }
        continue;
      }
      if (const auto attribute = attribute_of_other_kind(child, *kind); !attribute.empty()) {
        if (!std::exchange(is_other_kind, true)) refuse_other_kind(child, attribute, *kind);
        continue;  // what else is wrong with it follows from that
      }
      const std::size_t errors = diagnostics_.count(rules::Severity::kError);
      if (auto entry = read_entry(reader_, child, context)) {
        entry->has_errors = diagnostics_.count(rules::Severity::kError) != errors;
        gateway.entries.push_back(std::move(*entry));
      }
    }
    mapping_.gateways.push_back(std::move(gateway));
  }

  // What names its topic, if that is how the other kind does it.
  static std::string_view attribute_of_other_kind(const XmlNode& entry, Kind kind) {
    const std::string_view own = kind == Kind::kDds ? "topic" : "service";
    const std::string_view other = kind == Kind::kDds ? "service" : "topic";
    using rules::ElementReader;
    const bool is_other =
        ElementReader::has_attribute(entry, other) && !ElementReader::has_attribute(entry, own);
    return is_other ? other : std::string_view();
  }

  // Of the first such entry of a gateway: the others are alike.
  void refuse_other_kind(const XmlNode& entry, std::string_view attribute, Kind kind) {
    const bool is_dds = kind == Kind::kDds;
    const std::string other = name_of(is_dds ? Kind::kIceoryx : Kind::kDds);
    Attributes(reader_, entry)
        .error("other-kind", attribute,
               std::string(attribute) + "=\"…\" belongs to an entry of a <gateway kind=\"" + other +
                   "\">, and this one has kind=\"" + name_of(kind) +
                   "\"; correct the kind, or name " +
                   (is_dds ? "a topic of DDS: topic=\"…\" and type=\"…\""
                           : "a topic of iceoryx: service=\"…\", instance=\"…\" and event=\"…\"") +
                   ", in all its entries");
  }

  // In Cyclone capitals do not count.
  static bool is_of_cyclone(const rules::XmlDocument& document) {
    const Elements top(document.first());
    Elements::Iterator behind = top.begin();
    if (behind == top.end()) return false;
    const std::string_view root = (*behind).text;
    constexpr std::string_view kRoot = "cyclonedds";
    const bool is_root = std::equal(root.begin(), root.end(), kRoot.begin(), kRoot.end(),
                                    [](char a, char b) { return (a | 0x20) == b; });
    return is_root && ++behind == top.end();
  }

  static void refuse_twice(Attributes& attributes, std::vector<std::string> interfaces) {
    std::sort(interfaces.begin(), interfaces.end());
    const auto twice = std::adjacent_find(interfaces.begin(), interfaces.end());
    if (twice == interfaces.end()) return;
    attributes.error("invalid-value", "interface",
                     rules::quote(*twice) + " is named twice, which Cyclone refuses; name it once");
  }

  static void refuse_no_hosts(Attributes& attributes, const std::vector<std::string>& peers) {
    for (const std::string& peer : peers) {
      if (peer.find_first_of(" \t\n;/") == std::string::npos) continue;
      attributes.error("invalid-value", "peers",
                       rules::quote(peer) +
                           " is no address and no name; write several with commas between them");
    }
  }

  // Its elements are Cyclone's business, which says what it does not like when a domain is joined.
  std::string read_configuration(Attributes& attributes, const std::string& path) const {
    if (directory_ == nullptr) return {};
    try {
      const rules::TextFile file(
          path, read_file_(path, kMaxConfigurationBytes, rules::Accept::kRegularFile));
      if (!rules::check_size(file, kMaxConfigurationBytes, diagnostics_) ||
          !rules::check_readable(file, diagnostics_)) {
        return {};
      }
      const auto document = rules::parse_xml(file, diagnostics_);
      if (!document) return {};
      if (!is_of_cyclone(*document)) {
        diagnostics_.error("configuration-file", file.locate(0),
                           "this is no configuration of Cyclone DDS; its one root is <CycloneDDS>");
        return {};
      }
      return std::string(file.content());
    } catch (const rules::FileError& error) {
      attributes.error("configuration-file", "configuration",
                       std::string(error.what()) +
                           "; write the name of a configuration file of Cyclone DDS, as seen from "
                           "the mapping");
      return {};
    }
  }

  [[nodiscard]] std::string path_of(const std::string& written) const {
    const std::filesystem::path path = written;
    if (directory_ == nullptr || path.is_absolute()) return written;
    return (*directory_ / path).string();
  }

  const rules::TextFile& file_;
  rules::Diagnostics& diagnostics_;
  const std::string* const directory_;
  const ReadFile& read_file_;
  rules::Defines defines_;  // none: a mapping has no defines
  rules::ElementReader reader_;
  Mapping mapping_;
  std::size_t entries_ = 0;
};

}  // namespace

Mapping read_mapping(const rules::TextFile& file, rules::Diagnostics& diagnostics,
                     const std::string* directory, const ReadFile& read_file) {
  return MappingReader(file, diagnostics, directory, read_file).read();
}

Mapping read_mapping_file(const std::string& path, rules::Diagnostics& diagnostics,
                          const ReadFile& read_file) {
  const rules::TextFile file(path, read_file(path, rules::kMaxFileBytes, rules::Accept::kAnyFile));
  const std::string directory = std::filesystem::path(path).parent_path().string();
  return read_mapping(file, diagnostics, &directory, read_file);
}

}  // namespace arbiter::gateway
