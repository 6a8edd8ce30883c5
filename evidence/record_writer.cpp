#include "evidence/record_writer.hpp"

#include <time.h>

#include <algorithm>
#include <charconv>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>

#include "evidence/activity_json.hpp"
#include "shm/clock.hpp"
#include "shm/utf8.hpp"

namespace arbiter::evidence {
namespace {

// In the place of a byte that is not UTF-8: U+FFFD.
constexpr std::string_view kNoCharacter = "\xef\xbf\xbd";

// One object. Arrivals come by the ten thousand: each is put together in memory that is there.
class JsonLine {
 public:
  explicit JsonLine(std::string& out) : out_(out) { out_.assign(1, '{'); }

  JsonLine& add(std::string_view name, std::string_view text) {
    key(name);
    quote(text);
    return *this;
  }
  template <class Number>
  requires std::is_integral_v<Number> &&
      (!std::is_same_v<Number, bool>)JsonLine& add(std::string_view name, Number number) {
    key(name);
    char digits[24];
    const auto end = std::to_chars(digits, digits + sizeof digits, number).ptr;
    out_.append(digits, end);
    return *this;
  }
  JsonLine& add_flag(std::string_view name, bool value) {
    key(name);
    out_ += value ? "true" : "false";
    return *this;
  }
  JsonLine& add(std::string_view name, const std::vector<std::string>& texts,
                std::uint64_t mask = ~std::uint64_t{0}) {
    key(name);
    out_ += '[';
    for (std::size_t i = 0; i < texts.size() && (i < 64 || mask == ~std::uint64_t{0}); ++i) {
      if (i < 64 && (mask >> i & 1) == 0) continue;
      if (out_.back() != '[') out_ += ',';
      quote(texts[i]);
    }
    out_ += ']';
    return *this;
  }
  JsonLine& add(std::string_view name, const std::vector<ModelFile>& files) {
    key(name);
    out_ += '[';
    for (const ModelFile& file : files) {
      if (out_.back() != '[') out_ += ',';
      out_ += "{\"path\":";
      quote(file.path);
      out_ += ",\"text\":";
      quote(file.text);
      out_ += '}';
    }
    out_ += ']';
    return *this;
  }
  JsonLine& add_activity(ActivityWord word) {
    const WrittenActivity activity = written(word);
    return add("activity", activity.kind).add("activity_ns", activity.time);
  }
  void end() { out_ += '}'; }

 private:
  void key(std::string_view name) {
    if (out_.size() != 1) out_ += ',';
    out_ += '"';
    out_ += name;
    out_ += "\":";
  }
  // One text that is not UTF-8, such as what was typed, must not make a file unreadable.
  void quote(std::string_view text) {
    out_ += '"';
    while (!text.empty()) {
      std::size_t length = 1;
      if (static_cast<unsigned char>(text.front()) < 0x80) {
        add_ascii(text.front());
      } else {
        length = shm::decode_utf8(text).length;
        out_ += length == 0 ? kNoCharacter : text.substr(0, length);
      }
      text.remove_prefix(std::max<std::size_t>(length, 1));
    }
    out_ += '"';
  }
  void add_ascii(char byte) {
    constexpr std::string_view kHex = "0123456789abcdef";
    if (byte == '"' || byte == '\\') {
      out_ += '\\';
      out_ += byte;
    } else if (byte == '\n') {
      out_ += "\\n";  // a model is full of them
    } else if (byte < 0x20) {
      out_ += "\\u00";
      out_ += kHex[static_cast<std::size_t>(byte) >> 4];
      out_ += kHex[static_cast<std::size_t>(byte) & 15];
    } else {
      out_ += byte;
    }
  }

  std::string& out_;
};

// As text: in a number of JSON not all readers keep 64 bits.
std::string hex_of(std::uint64_t number) {
  char digits[16];
  const auto end = std::to_chars(digits, digits + sizeof digits, number, 16).ptr;
  return {digits, end};
}

struct Written {
  RecordKind kind;
  Nanoseconds time;
};

Written put(JsonLine& out, const Start& each) {
  out.add("time_ns", each.time).add("instance", each.instance).add("ports", each.ports);
  out.add("payloads", each.payloads);
  return {RecordKind::kStart, each.time};
}

Written put(JsonLine& out, const Arrival& each) {
  const auto& ports = each.context->destinations;
  out.add("source", each.context->source)
      .add("kind", each.is_sample ? "sample" : "signal")
      .add("time_ns", each.time)
      .add("seen_ns", each.seen)
      .add("sequence", each.sequence)
      .add("size", each.size)
      .add("generation", each.generation)
      .add_activity(each.word)
      .add_flag("has_payload", each.payload.has_value())
      .add("accepted", ports, each.masks.accepted)
      .add("discarded", ports, each.masks.discarded)
      .add("refused", ports, each.masks.refused)
      .add("blind", ports, each.masks.blind);
  if (each.origin.publisher != 0) {
    out.add("origin", hex_of(each.origin.publisher)).add("origin_sequence", each.origin.sequence);
  }
  return {RecordKind::kArrival, each.time};
}

Written put(JsonLine& out, const Deactivation& each) {
  out.add("source", each.context->source).add("time_ns", each.time).add("seen_ns", each.seen);
  out.add("sequence", each.sequence).add("generation", each.generation);
  return {RecordKind::kDeactivation, each.time};
}

Written put(JsonLine& out, const SourceState& each) {
  out.add("source", each.context->source)
      .add("why", name_of(each.why))
      .add("time_ns", each.time)
      .add("seen_ns", each.seen)
      .add("sequence", each.sequence)
      .add("generation", each.generation)
      .add("lost", each.lost)
      .add_activity(each.word);
  if (each.context->is_described) {
    out.add("type", each.context->type)
        .add("type_size", each.context->size)
        .add("type_alignment", each.context->alignment)
        .add("destinations", each.context->destinations);
  }
  return {RecordKind::kState, each.seen};
}

Written put(JsonLine& out, const DestinationsChange& each) {
  out.add("source", each.context->source).add("time_ns", each.time).add("seen_ns", each.seen);
  out.add("destinations", each.context->destinations);
  return {RecordKind::kDestinations, each.seen};
}

Written put(JsonLine& out, const PortChange& each) {
  out.add("what", name_of(each.what)).add("direction", each.is_input ? "input" : "output");
  out.add("port", each.port).add("node", each.node).add("pid", each.pid);
  out.add("type", each.type).add("seen_ns", each.seen);
  if (!each.host.empty()) out.add("host", each.host);
  return {RecordKind::kPort, each.seen};
}

Written put(JsonLine& out, const ModelChange& each) {
  std::vector<ModelFile> application;
  if (each.application) application.push_back(*each.application);
  out.add("time_ns", each.time).add("seen_ns", each.seen).add("generation", each.generation);
  out.add("name", each.name).add("how", each.how).add("by", each.by);
  out.add_flag("has_texts", each.has_texts).add("files", each.files);
  out.add("application", application);
  return {RecordKind::kModel, each.time == 0 ? each.seen : each.time};
}

Written put(JsonLine& out, const WinnerChange& each) {
  out.add("port", each.port).add("winner", each.winner).add("before", each.before);
  out.add("time_ns", each.time).add("why", name_of(each.why)).add("by", each.by);
  out.add("generation", each.generation);
  return {RecordKind::kWinner, each.time};
}

Written put(JsonLine& out, const Missed& each) {
  out.add("source", each.source).add("from_ns", each.from).add("to_ns", each.to);
  out.add("events", each.events).add("samples", each.samples).add("why", name_of(each.why));
  out.add("text", each.text);
  return {RecordKind::kMissed, each.to};
}

recording::McapTime as_wall(Nanoseconds time, std::int64_t offset) {
  const std::int64_t wall = std::clamp(time, Nanoseconds{0}, shm::kMaxTime) + offset;
  return wall < 0 ? 0 : static_cast<recording::McapTime>(wall);
}

}  // namespace

std::int64_t wall_offset_now() {
  timespec wall{};
  clock_gettime(CLOCK_REALTIME, &wall);
  return std::int64_t{wall.tv_sec} * 1'000'000'000 + wall.tv_nsec - shm::monotonic_now();
}

RecordWriter::RecordWriter(const std::string& path, const recording::McapOptions& options,
                           const RecordingInfo& info)
    : file_(path, info.program, options), wall_offset_(info.wall_offset), say_(info.say) {
  file_.write_metadata(std::string(kMetadataName),
                       {{"format", std::string(kFormat)},
                        {"instance", info.instance},
                        {"host", info.host},
                        {"command", info.command},
                        {"clock", "CLOCK_MONOTONIC"},
                        {"wall_offset_ns", std::to_string(info.wall_offset)}});
  for (std::size_t kind = 0; kind < kRecordKinds; ++kind) {
    const RecordSchema& schema = record_schemas[kind];
    const auto id = file_.add_schema({std::string(schema.name), "jsonschema", schema.json()});
    channels_[kind] = file_.add_channel({id, std::string(schema.topic), "json", {}});
  }
}

Arrival without_payload(const Arrival& from) {
  return {from.context, from.time,       from.seen, from.is_sample, from.sequence,
          from.size,    from.generation, from.word, from.masks,     from.origin};
}

void RecordWriter::write(const Record& record) {
  const auto* arrival = std::get_if<Arrival>(&record);
  if (arrival == nullptr || !arrival->payload) return write_record(record);
  const std::uint16_t channel = channel_of(*arrival->context);
  if (channel == 0) return leave_out_payload(*arrival);
  write_record(record);
  // Directly behind its arrival.
  const recording::McapTime wall = as_wall(arrival->time, wall_offset_);
  file_.write({channel, static_cast<std::uint32_t>(arrival->sequence), wall, wall,
               std::span(*arrival->payload)});
}

// The rest goes on, as where the daemon does not have them.
ModelChange RecordWriter::without_texts(const ModelChange& model) const {
  if (say_) {
    say_("the texts of model " + std::to_string(model.generation) +
         " are too large for a recording: its decisions cannot be taken again");
  }
  ModelChange result;
  result.time = model.time;
  result.seen = model.seen;
  result.generation = model.generation;
  result.name = model.name;
  result.how = model.how;
  result.by = model.by;
  return result;
}

void RecordWriter::write_record(const Record& record) {
  JsonLine line(json_);
  const Written written = std::visit([&](const auto& each) { return put(line, each); }, record);
  line.end();
  if (const auto* start = std::get_if<Start>(&record)) start_ = start->time;
  const auto* model = std::get_if<ModelChange>(&record);
  if (model != nullptr && model->has_texts && json_.size() > max_record_bytes(written.kind)) {
    return write_record(without_texts(*model));
  }
  write_json(written.kind, written.time, json_);
}

void RecordWriter::leave_out_payload(const Arrival& arrival) {
  const std::string text = "the file has payloads of as many sources and types as it can";
  const std::string& source = arrival.context->source;
  if (!std::exchange(is_full_, true) && say_) {
    say_(text + ": those of " + source + " are left out, and of all other types that come");
  }
  write_record(Missed{source, arrival.time, arrival.time, 0, 1, Missed::Why::too_large, text});
  write_record(without_payload(arrival));
}

void RecordWriter::close(Nanoseconds end) {
  if (end != 0) file_.write_metadata(std::string(kEndName), {{"time_ns", std::to_string(end)}});
  file_.close();
}

void RecordWriter::write_json(RecordKind kind, Nanoseconds time, const std::string& json) {
  const auto index = static_cast<std::size_t>(kind);
  if (json.size() > max_record_bytes(kind)) {
    throw recording::McapError("a record of topic " + std::string(record_schemas[index].topic) +
                               " has " + std::to_string(json.size()) +
                               " bytes, more than anybody reads");
  }
  // What was so before, such as the model, is in the recording from its start.
  const recording::McapTime wall = as_wall(std::max(time, start_), wall_offset_);
  const auto number = static_cast<std::uint32_t>(counts_[index]++);
  file_.write({channels_[index], number, wall, wall, std::as_bytes(std::span(json))});
}

// 0: the file has no room for one more.
std::uint16_t RecordWriter::channel_of(const SourceContext& context) {
  const std::string size = std::to_string(context.size);
  const std::string alignment = std::to_string(context.alignment);
  const std::string key = context.source + '\n' + context.type + '\n' + size + '\n' + alignment;
  const auto known = payload_channels_.find(key);
  if (known != payload_channels_.end()) return known->second;
  if (is_full_) return 0;
  try {
    std::uint16_t schema = 0;
    if (!context.type.empty()) {
      const auto [type, is_new_type] = types_.try_emplace(context.type, 0);
      if (is_new_type) type->second = file_.add_schema({context.type, "", ""});
      schema = type->second;
    }
    return payload_channels_[key] = file_.add_channel(
               {schema,
                context.source,
                std::string(kPayloadEncoding),
                {{"type", context.type}, {"size", size}, {"alignment", alignment}}});
  } catch (const recording::McapError&) {  // neither writes, so it is not the disk
    return 0;
  }
}

}  // namespace arbiter::evidence
