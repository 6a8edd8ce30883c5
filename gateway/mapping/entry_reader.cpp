#include "gateway/mapping/entry_reader.hpp"

#include <filesystem>
#include <span>

#include "gateway/mapping/attributes.hpp"
#include "gateway/mapping/encapsulation.hpp"
#include "gateway/mapping/field_reader.hpp"
#include "gateway/mapping/ros_names.hpp"
#include "gateway/mapping/topic_reader.hpp"
#include "rules/text/names.hpp"
#include "rules/text/text_file.hpp"
#include "shm/limits.hpp"
#include "shm/type_info.hpp"

namespace arbiter::gateway {
namespace {

// An attribute that another one needs, or excludes, means a mistake; to pass it over would hide it.
class EntryReader {
 public:
  EntryReader(rules::ElementReader& reader, const rules::XmlNode& element,
              const EntryContext& context)
      : reader_(reader), element_(element), context_(context), attributes_(reader, element) {}

  std::optional<Entry> read() {
    entry_.where = reader_.where(element_);
    entry_.direction = element_.text == "in" ? Entry::Direction::kIn : Entry::Direction::kOut;
    check_shape();
    read_topic();
    if (const auto max_size = attributes_.bytes("max_size", 1, kMaxSampleBytes)) {
      entry_.max_size = *max_size;
    }
    read_type();
    if (entry_.is_in()) {
      read_sources();
      entry_.max_age = attributes_.duration("max_age");
    } else {
      if (auto port = attributes_.port("port")) entry_.port = std::move(*port);
      if (const auto queue = attributes_.number("queue", 1, shm::kMaxDepth)) {
        entry_.queue = static_cast<std::uint32_t>(*queue);
      }
      read_idle();
    }
    if (!entry_.port && !entry_.choice) return {};
    return std::move(entry_);
  }

 private:
  void check_shape() {
    const bool is_dds = context_.kind == Kind::kDds;
    if (is_dds && entry_.is_in()) {
      reader_.check_attributes(
          element_,
          {"topic",       "type",       "port",    "true",  "false",    "above",     "below",
           "threshold",   "field",      "offset",  "size",  "max_size", "max_age",   "qos",
           "reliability", "durability", "history", "depth", "deadline", "partition", "keyed"});
    } else if (is_dds) {
      reader_.check_attributes(
          element_,
          {"port", "topic", "type", "idle", "size", "queue", "max_size", "qos", "reliability",
           "durability", "history", "depth", "deadline", "partition", "keyed", "representation"});
    } else if (entry_.is_in()) {
      reader_.check_attributes(
          element_, {"service", "instance", "event", "port", "true", "false", "above", "below",
                     "threshold", "field", "offset", "type", "size", "alignment", "user_header",
                     "queue", "max_size", "max_age"});
    } else {
      reader_.check_attributes(
          element_, {"port", "service", "instance", "event", "idle", "type", "size", "alignment",
                     "user_header", "history", "queue", "max_size"});
    }
    reader_.check_no_text(element_.first_child);
    for (const rules::XmlNode& child : rules::Elements(element_.first_child)) {
      reader_.report_unknown_element(child, {});
    }
  }

  void read_topic() {
    if (context_.kind == Kind::kDds) {
      entry_.dds = read_dds_topic(attributes_, entry_.is_in());
    } else {
      entry_.iceoryx = read_iceoryx_topic(attributes_, entry_.is_in());
    }
  }

  // How many bytes stand before a sample's own data.
  [[nodiscard]] std::size_t header() const {
    return entry_.dds ? kEncapsulationBytes : entry_.iceoryx->padded_header();
  }

  void read_type() {
    if (entry_.dds) {
      read_dds_type();
      return;
    }
    const auto size = attributes_.bytes("size", 1, kMaxSampleBytes);
    if (size) known_size_ = *size;
    const auto name = attributes_.text("type", shm::kMaxTypeName);
    if (size) make_room_for(header() + *size, "size");
    if (!name) {
      if (size && !attributes_.has("idle")) {
        attributes_.error("misplaced-attribute", "size",
                          "size=\"…\" says how large each sample of a type is; add type=\"…\", or "
                          "write max_size=\"…\" for the largest sample");
      }
      return;
    }
    entry_.type = PortType{*name, size ? header() + *size : 0, entry_.iceoryx->alignment};
    check_type(size ? header() + *size : 1);
  }

  // As a port's.
  void check_type(std::size_t size) {
    shm::TypeInfo info;
    info.set_name(entry_.type->name);
    info.size = size;
    if (const auto fault = shm::fault_of(info)) {
      attributes_.error("invalid-type", "type",
                        rules::quote(entry_.type->name) + " cannot be a type: " + *fault +
                            "; write another name");
    }
  }

  void read_dds_type() {
    const std::string name = readable_type(entry_.dds->type);
    entry_.type = PortType{name, 0, 1};
    if (!name.empty()) check_type(1);
    known_size_ = fixed_size_of(name);
    if (known_size_) make_room_for(header() + *known_size_, "type");
    // Of `out` also a zero sample's.
    const auto said =
        attributes_.bytes("size", 1, entry_.is_in() ? kMaxSampleBytes - header() : kMaxIdleBytes);
    if (said && has_strings(name)) {
      attributes_.error("invalid-value", "size",
                        rules::quote(name) +
                            " has a string in it, so that its samples have not all one size; "
                            "remove size=\"…\"");
    } else if (said && known_size_ && *said != *known_size_) {
      attributes_.error(
          "invalid-value", "size",
          "a " + name + " has " + bytes_text(*known_size_) + "; correct the size, or leave it out");
    } else if (said) {
      known_size_ = *said;
      make_room_for(header() + *said, "size");
    }
    entry_.dds->size = known_size_;
  }

  // One source, or two that a field chooses between.
  void read_sources() {
    const bool is_boolean = attributes_.has("true") || attributes_.has("false");
    const bool is_number = attributes_.has("above") || attributes_.has("below");
    const int ways = (attributes_.has("port") ? 1 : 0) + (is_boolean ? 1 : 0) + (is_number ? 1 : 0);
    if (ways > 1) {
      reader_.error("several-ports", reader_.where(element_),
                    "an entry has port, or true and false, or above and below; remove the "
                    "others, or write an entry for each");
      return;
    }
    if (!is_boolean && !is_number) {
      refuse_without("threshold", "above");
      refuse_without("field", "above");
      refuse_without("offset", "true");
      if (auto port = attributes_.port("port")) entry_.port = std::move(*port);
      return;
    }
    if (is_boolean) {
      refuse_without("threshold", "above");
      refuse_without("field", "above");
    }
    const std::string_view yes = is_boolean ? "true" : "above";
    const std::string_view no = is_boolean ? "false" : "below";
    Choice choice =
        read_field(attributes_, {entry_.dds.has_value(), entry_.type ? entry_.type->name : "",
                                 header(), known_size_, entry_.max_size});
    if (attributes_.has(yes)) choice.yes = attributes_.port(yes);
    if (attributes_.has(no)) choice.no = attributes_.port(no);
    if (!choice.yes && !choice.no) return;
    if (choice.yes && choice.no && choice.yes->name == choice.no->name) {
      reader_.error("duplicate-port", choice.no->where,
                    "both sources are " + rules::quote(choice.no->name) +
                        "; name two, or leave one of the attributes out");
      return;
    }
    entry_.choice = std::move(choice);
  }

  void refuse_without(std::string_view name, std::string_view other) {
    if (!attributes_.has(name)) return;
    attributes_.error("misplaced-attribute", name,
                      std::string(name) +
                          "=\"…\" belongs to an entry whose field chooses a "
                          "source; add " +
                          std::string(other) + "=\"…\", or remove it");
  }

  void read_idle() {
    const auto text = attributes_.text("idle", 4096);
    if (!text || *text == "none") return;
    if (*text == "zero") {
      read_zero();
    } else if (text->starts_with("file:")) {
      read_idle_file(text->substr(5));
    } else {
      attributes_.error("invalid-value", "idle",
                        "idle=" + rules::quote(*text) +
                            " is not known; write none, zero, or file: with a file's name");
    }
    make_room_for(entry_.idle.sample.size(), "idle");
  }

  // A sample of `bytes`, headers included, is to fit, as that attribute asks.
  void make_room_for(std::size_t bytes, std::string_view attribute) {
    if (bytes <= entry_.max_size) return;
    if (attributes_.has("max_size")) {
      attributes_.error("contradiction", "max_size",
                        "max_size is " + std::to_string(entry_.max_size) +
                            " bytes, and the sample that " + std::string(attribute) +
                            "=\"…\" asks for has " + std::to_string(bytes) +
                            " with its headers; correct one of the two");
    }
    entry_.max_size = bytes;
  }

  void read_zero() {
    if (entry_.dds) {
      const auto without_frame = size_without_frame(entry_.type->name);
      if (!without_frame && !may_be_zero()) return;
      entry_.idle.sample.resize(header() + without_frame.value_or(known_size_.value_or(0)));
      if (without_frame) entry_.idle.sample[header() + kFrameLengthOffset] = std::byte{1};
      const bool is_xcdr2 = entry_.dds->qos.representation == Representation::kXcdr2;
      entry_.idle.sample[1] = is_xcdr2 ? std::byte{7} : std::byte{1};  // little-endian
    } else if (!known_size_) {
      attributes_.error("idle-size", "idle",
                        "how large a zero sample is cannot be known; add size=\"BYTES\", or give "
                        "a sample: idle=\"file:…\"");
      return;
    } else {
      entry_.idle.sample.resize(header() + *known_size_);
    }
    entry_.idle.kind = Idle::Kind::kZero;
  }

  // Of a type that has strings or sequences zero bytes are no sample: even an empty string has a
  // length of 1, its final zero.
  bool may_be_zero() {
    const std::string& type = entry_.type->name;
    if (has_strings(type)) {
      attributes_.error("idle-size", "idle",
                        rules::quote(type) +
                            " has strings or sequences, of which zero bytes are no sample; give a "
                            "sample: idle=\"file:…\"");
      return false;
    }
    if (!known_size_) {
      attributes_.error("idle-size", "idle",
                        "how large a zero " + rules::quote(type) +
                            " is cannot be known; if it has no string and no sequence, add "
                            "size=\"BYTES\" (of its CDR, without the header), else give a sample: "
                            "idle=\"file:…\"");
    }
    return known_size_.has_value();
  }

  void read_idle_file(std::string_view written) {
    entry_.idle.kind = Idle::Kind::kFile;
    const std::filesystem::path name = rules::trim(written);
    if (name.empty()) {
      attributes_.error("invalid-value", "idle", "file: lacks a file's name; write file:stop.bin");
      return;
    }
    entry_.idle.path = name.string();
    if (context_.directory == nullptr) return;
    if (name.is_relative()) entry_.idle.path = (*context_.directory / name).string();
    try {
      const std::string bytes =
          context_.read_file(entry_.idle.path, kMaxIdleBytes, rules::Accept::kRegularFile);
      if (const auto fault = fault_of_idle(bytes); !fault.empty()) {
        attributes_.error("idle-size", "idle", rules::quote(entry_.idle.path) + " " + fault);
        return;
      }
      const auto* const data = reinterpret_cast<const std::byte*>(bytes.data());
      entry_.idle.sample.assign(data, data + bytes.size());
    } catch (const rules::FileError& error) {
      attributes_.error("idle-file", "idle",
                        std::string(error.what()) +
                            "; write the name of a file that holds a "
                            "sample, as seen from the mapping");
    }
  }

  // What is wrong with a sample of a file; empty: nothing. A subscriber takes what it gets for a
  // sample of its type, and may read as many bytes as that has.
  [[nodiscard]] std::string fault_of_idle(const std::string& bytes) const {
    const std::string has = "has " + bytes_text(bytes.size()) + "; ";
    // Nobody means to send a chunk of iceoryx that has nothing in it.
    const std::size_t least = header() + (entry_.dds ? 0 : 1);
    if (bytes.size() > kMaxIdleBytes || bytes.size() < least) {
      return has + "a sample to be sent while the port is idle has " + std::to_string(least) +
             " to " + std::to_string(kMaxIdleBytes);
    }
    const auto counted = [&](std::size_t size) {
      return has + "a sample has " + std::to_string(header()) + " of headers and " +
             std::to_string(size) + " of its own: write another file";
    };
    if (!entry_.dds) {
      if (!known_size_ || bytes.size() == header() + *known_size_) return {};
      return counted(*known_size_) + ", or correct the size";
    }
    const Encapsulation encapsulation = read_encapsulation(std::as_bytes(std::span(bytes)));
    const bool is_xcdr2 = encapsulation.encoding == Encoding::kXcdr2;
    if (encapsulation.encoding == Encoding::kUnknown) {
      return "does not begin with the encapsulation header of DDS, such as 00 01 00 00 for "
             "little-endian CDR; write it before the sample";
    }
    // The writer sends nothing else.
    if (is_xcdr2 != (entry_.dds->qos.representation == Representation::kXcdr2)) {
      return is_xcdr2 ? "is XCDR2, by its encapsulation header, and the entry sends XCDR1; write "
                        "another file, or representation=\"xcdr2\""
                      : "is XCDR1, by its encapsulation header, and the entry sends XCDR2; write "
                        "another file, or leave out the representation";
    }
    if (!known_size_ || may_have(encapsulation, bytes.size() - header(), *known_size_)) return {};
    return counted(*known_size_);
  }

  rules::ElementReader& reader_;
  const rules::XmlNode& element_;
  const EntryContext& context_;
  Attributes attributes_;
  Entry entry_;
  std::optional<std::size_t> known_size_;  // of a sample's data; absent: it may vary
};

}  // namespace

std::optional<Entry> read_entry(rules::ElementReader& reader, const rules::XmlNode& element,
                                const EntryContext& context) {
  return EntryReader(reader, element, context).read();
}

}  // namespace arbiter::gateway
