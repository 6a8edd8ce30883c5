#include "evidence/record_reader.hpp"

#include <charconv>
#include <map>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <nlohmann/json.hpp>

#include "evidence/activity_json.hpp"
#include "evidence/record_schemas.hpp"
#include "shm/limits.hpp"

namespace arbiter::evidence {
namespace {

using nlohmann::json;

// One object of a known kind.
class Fields {
 public:
  explicit Fields(const json& object) : object_(object) {}

  [[nodiscard]] bool has(const char* name) const { return object_.contains(name); }
  [[nodiscard]] std::uint64_t number(const char* name) const {
    const json& value = at(name);
    if (!value.is_number_integer() || value < 0) fail(name, "is not a whole number of at least 0");
    return value.get<std::uint64_t>();
  }
  [[nodiscard]] Nanoseconds time(const char* name) const {
    const std::uint64_t value = number(name);
    if (value > static_cast<std::uint64_t>(shm::kMaxTime)) fail(name, "is not a time");
    return static_cast<Nanoseconds>(value);
  }
  [[nodiscard]] std::uint64_t hex(const char* name) const {
    const std::string& digits = text(name);
    const char* const end = digits.data() + digits.size();
    std::uint64_t value = 0;
    const auto read = std::from_chars(digits.data(), end, value, 16);
    if (read.ec != std::errc() || read.ptr != end) fail(name, "is no hexadecimal number");
    return value;
  }
  [[nodiscard]] bool flag(const char* name) const {
    if (!at(name).is_boolean()) fail(name, "is neither true nor false");
    return at(name).get<bool>();
  }
  [[nodiscard]] const std::string& text(const char* name) const { return text_of(at(name), name); }
  [[nodiscard]] std::vector<std::string> texts(const char* name) const {
    std::vector<std::string> all;
    for (const json& each : list(name)) all.push_back(text_of(each, name));
    return all;
  }
  [[nodiscard]] std::vector<ModelFile> files(const char* name) const {
    std::vector<ModelFile> all;
    for (const json& each : list(name)) {
      if (!each.is_object()) fail(name, "has something that is not a file");
      const Fields file(each);
      all.push_back({file.text("path"), file.text("text")});
    }
    return all;
  }
  // One of the names that name_of() gives.
  template <class Word>
  [[nodiscard]] Word word(const char* name, std::initializer_list<Word> words) const {
    for (const Word each : words) {
      if (name_of(each) == text(name)) return each;
    }
    fail(name, "is none of the words that it may be");
  }
  [[nodiscard]] ActivityWord activity() const {
    const auto word = activity_of(text("activity"), time_of_activity());
    if (!word) fail("activity", "is not an activity");
    return *word;
  }

 private:
  // The end of an activity may lie behind the times that a clock shows.
  [[nodiscard]] Nanoseconds time_of_activity() const {
    const std::uint64_t value = number("activity_ns");
    return value >= static_cast<std::uint64_t>(shm::kForeverFlag) ? -1
                                                                  : static_cast<Nanoseconds>(value);
  }
  [[nodiscard]] const json& at(const char* name) const {
    const auto found = object_.find(name);
    if (found == object_.end()) fail(name, "is missing");
    return *found;
  }
  [[nodiscard]] const json& list(const char* name) const {
    if (!at(name).is_array()) fail(name, "is not a list");
    return at(name);
  }
  [[nodiscard]] static const std::string& text_of(const json& value, const char* name) {
    if (!value.is_string()) fail(name, "is not a text");
    return value.get_ref<const std::string&>();
  }
  [[noreturn]] static void fail(const char* name, const char* what) {
    throw RecordError(std::string("its field \"") + name + "\" " + what);
  }

  const json& object_;
};

// The contexts that have been read, and what they are now.
class Contexts {
 public:
  ContextPtr of(const std::string& source) {
    ContextPtr& context = contexts_[source];
    if (context == nullptr) {
      auto made = std::make_shared<SourceContext>();
      made->source = source;
      context = std::move(made);
    }
    return context;
  }
  template <class Change>
  ContextPtr change(const std::string& source, const Change& change) {
    auto changed = std::make_shared<SourceContext>(*of(source));
    change(*changed);
    return contexts_[source] = std::move(changed);
  }
  // The bits of these ports. One that no list has named gets a bit of its own.
  std::uint64_t mask(ContextPtr& context, const std::vector<std::string>& ports) {
    std::uint64_t mask = 0;
    for (const std::string& port : ports) {
      std::size_t bit = 0;
      const auto& known = context->destinations;
      while (bit < known.size() && known[bit] != port) ++bit;
      if (bit >= shm::kMaxDestinations) {
        throw RecordError("it has more than " + std::to_string(shm::kMaxDestinations) +
                          " destinations");
      }
      if (bit == known.size()) {
        context =
            change(context->source, [&](SourceContext& all) { all.destinations.push_back(port); });
      }
      mask |= std::uint64_t{1} << bit;
    }
    return mask;
  }

 private:
  std::unordered_map<std::string, ContextPtr> contexts_;
};

Record read_start(const Fields& in) {
  return Start{in.time("time_ns"), in.text("instance"), in.texts("ports"), in.text("payloads")};
}

Record read_arrival(const Fields& in, Contexts& contexts) {
  Arrival each;
  each.context = contexts.of(in.text("source"));
  const std::string& kind = in.text("kind");
  if (kind != "sample" && kind != "signal") throw RecordError("it is neither sample nor signal");
  each.is_sample = kind == "sample";
  each.time = in.time("time_ns");
  each.seen = std::max(in.time("seen_ns"), each.time);
  each.sequence = in.number("sequence");
  each.size = in.number("size");
  each.generation = in.number("generation");
  each.word = in.activity();
  each.has_payload = in.flag("has_payload");
  each.masks.accepted = contexts.mask(each.context, in.texts("accepted"));
  each.masks.discarded = contexts.mask(each.context, in.texts("discarded"));
  each.masks.refused = contexts.mask(each.context, in.texts("refused"));
  each.masks.blind = contexts.mask(each.context, in.texts("blind"));
  if (in.has("origin")) each.origin = {in.hex("origin"), in.number("origin_sequence")};
  return each;
}

Record read_deactivation(const Fields& in, Contexts& contexts) {
  Deactivation each;
  each.context = contexts.of(in.text("source"));
  each.time = in.time("time_ns");
  each.seen = std::max(in.time("seen_ns"), each.time);
  each.sequence = in.number("sequence");
  each.generation = in.number("generation");
  return each;
}

void check_destinations(const std::vector<std::string>& ports) {
  if (ports.size() > shm::kMaxDestinations) throw RecordError("it has too many destinations");
}

Record read_state(const Fields& in, Contexts& contexts) {
  using Why = SourceState::Why;
  SourceState each;
  SourceContext told;
  told.source = in.text("source");
  told.is_described = in.has("type");
  if (told.is_described) {
    told.type = in.text("type");
    told.size = in.number("type_size");
    told.alignment = in.number("type_alignment");
    told.destinations = in.texts("destinations");
    check_destinations(told.destinations);
  }
  each.context =
      contexts.change(in.text("source"), [&](SourceContext& context) { context = told; });
  each.why = in.word<Why>("why", {Why::page, Why::joined, Why::gap, Why::closed});
  each.time = in.time("time_ns");
  each.seen = std::max(in.time("seen_ns"), each.time);
  each.sequence = in.number("sequence");
  each.generation = in.number("generation");
  each.lost = in.number("lost");
  each.word = in.activity();
  return each;
}

Record read_destinations(const Fields& in, Contexts& contexts) {
  DestinationsChange each;
  const auto destinations = in.texts("destinations");
  check_destinations(destinations);
  each.context = contexts.change(
      in.text("source"), [&](SourceContext& context) { context.destinations = destinations; });
  each.time = in.time("time_ns");
  each.seen = in.time("seen_ns");
  return each;
}

Record read_port(const Fields& in) {
  using What = PortChange::What;
  PortChange each;
  each.what = in.word<What>("what", {What::open, What::opened, What::closed, What::died});
  each.is_input = in.text("direction") == "input";
  each.port = in.text("port");
  each.node = in.text("node");
  each.pid = static_cast<std::int64_t>(in.number("pid"));
  each.type = in.text("type");
  each.seen = in.time("seen_ns");
  if (in.has("host")) each.host = in.text("host");
  return each;
}

Record read_model(const Fields& in) {
  ModelChange each;
  each.time = in.time("time_ns");
  each.seen = in.time("seen_ns");
  each.generation = in.number("generation");
  each.name = in.text("name");
  each.how = in.text("how");
  each.by = in.text("by");
  each.has_texts = in.flag("has_texts");
  each.files = in.files("files");
  auto application = in.files("application");
  if (!application.empty()) each.application = std::move(application.front());
  return each;
}

Record read_winner(const Fields& in) {
  using Why = WinnerChange::Why;
  WinnerChange each;
  each.port = in.text("port");
  each.winner = in.text("winner");
  each.before = in.text("before");
  each.time = in.time("time_ns");
  each.why = in.word<Why>(
      "why", {Why::start, Why::arrival, Why::expiry, Why::deactivation, Why::model, Why::state});
  each.by = in.text("by");
  each.generation = in.number("generation");
  return each;
}

Record read_missed(const Fields& in) {
  using Why = Missed::Why;
  Missed each;
  each.source = in.text("source");
  each.from = in.time("from_ns");
  each.to = in.time("to_ns");
  each.events = in.number("events");
  each.samples = in.number("samples");
  each.why = in.word<Why>("why", {Why::overtaken, Why::queue, Why::refused});
  each.text = in.text("text");
  return each;
}

Record read_record(RecordKind kind, const Fields& in, Contexts& contexts) {
  switch (kind) {
    case RecordKind::kStart:
      return read_start(in);
    case RecordKind::kArrival:
      return read_arrival(in, contexts);
    case RecordKind::kDeactivation:
      return read_deactivation(in, contexts);
    case RecordKind::kState:
      return read_state(in, contexts);
    case RecordKind::kDestinations:
      return read_destinations(in, contexts);
    case RecordKind::kPort:
      return read_port(in);
    case RecordKind::kModel:
      return read_model(in);
    case RecordKind::kWinner:
      return read_winner(in);
    case RecordKind::kMissed:
      break;
  }
  return read_missed(in);
}

class Reading {
 public:
  Reading(const std::string& path, Payloads payloads, const std::function<void(Record&&)>& use)
      : path_(path), reads_payloads_(payloads == Payloads::read), use_(use) {}

  ReadRecording run(const recording::Watch& watch) {
    recording::McapVisitor visitor;
    visitor.watch = watch;
    visitor.channel = [this](std::uint16_t id, const recording::McapChannel& channel) {
      add(id, channel);
    };
    visitor.message = [this](const recording::McapMessage& message) { take(message); };
    visitor.metadata = [this](const std::string& name, const recording::McapMap& map) {
      take(name, map);
    };
    result_.end = recording::read_mcap(path_, visitor);
    hand_on();
    if (!has_metadata_) refuse();
    return std::move(result_);
  }

 private:
  [[noreturn]] void refuse() const {
    const std::string damage = result_.end.is_whole ? "" : "; " + result_.end.problem;
    throw RecordError(path_ + " is not a recording that arbiter has made" + damage);
  }

  void add(std::uint16_t id, const recording::McapChannel& channel) {
    for (std::size_t kind = 0; kind < kRecordKinds; ++kind) {
      if (channel.topic == record_schemas[kind].topic) kinds_[id] = static_cast<RecordKind>(kind);
    }
    if (channel.message_encoding == kPayloadEncoding) payloads_of_[id] = channel.topic;
  }

  void take(const std::string& name, const recording::McapMap& map) {
    if (name == kEndName) take_end(map);
    if (name != kMetadataName) return;
    const auto value = [&](const char* key) {
      const auto found = map.find(key);
      return found == map.end() ? std::string() : found->second;
    };
    if (value("format") != kFormat) {
      throw RecordError(path_ + " is a recording of format " + value("format") +
                        ", which this arbiter cannot read");
    }
    has_metadata_ = true;
    result_.instance = value("instance");
    result_.host = value("host");
    result_.wall_offset = wall_offset_of(value("wall_offset_ns"));
  }

  // A time that is none says nothing.
  void take_end(const recording::McapMap& map) {
    const auto found = map.find("time_ns");
    if (found == map.end()) return;
    Nanoseconds time = 0;
    const char* const end = found->second.data() + found->second.size();
    const auto read = std::from_chars(found->second.data(), end, time);
    const bool is_one =
        read.ec == std::errc() && read.ptr == end && time > 0 && time <= shm::kMaxTime;
    if (is_one) result_.recorded_until = time;
  }

  // It can be added to any time of a recording. A file that says nothing of it is read all the
  // same.
  std::int64_t wall_offset_of(const std::string& text) const {
    std::int64_t offset = 0;
    const char* const end = text.data() + text.size();
    const auto read = std::from_chars(text.data(), end, offset);
    const bool is_one = read.ec == std::errc() && read.ptr == end && offset > -shm::kForeverFlag &&
                        offset < shm::kForeverFlag;
    if (text.empty() || is_one) return offset;
    throw RecordError(path_ + " does not say how far its times are from those of the wall clock");
  }

  void take(const recording::McapMessage& message) {
    if (const auto payload = payloads_of_.find(message.channel); payload != payloads_of_.end()) {
      take_payload(payload->second, message);
      return;
    }
    const auto kind = kinds_.find(message.channel);
    if (kind == kinds_.end()) return;
    hand_on();
    const auto* text = reinterpret_cast<const char*>(message.data.data());
    const json object = json::parse(text, text + message.data.size(), nullptr, false);
    try {
      if (!object.is_object()) throw RecordError("it is not a JSON object");
      waiting_ = read_record(kind->second, Fields(object), contexts_);
    } catch (const RecordError& error) {
      throw RecordError(path_ + ": record " + std::to_string(result_.records + 1) + ", of topic " +
                        std::string(record_schemas[static_cast<std::size_t>(kind->second)].topic) +
                        ": " + error.what());
    }
    ++result_.records;
  }

  // It stands directly behind its arrival.
  void take_payload(const std::string& source, const recording::McapMessage& message) {
    if (!reads_payloads_ || !waiting_) return;
    auto* arrival = std::get_if<Arrival>(&*waiting_);
    if (arrival == nullptr || arrival->context->source != source ||
        static_cast<std::uint32_t>(arrival->sequence) != message.sequence) {
      return;
    }
    arrival->payload.emplace(message.data.begin(), message.data.end());
  }

  void hand_on() {
    if (!waiting_) return;
    Record record = std::move(*waiting_);
    waiting_.reset();
    use_(std::move(record));
  }

  const std::string& path_;
  const bool reads_payloads_;
  const std::function<void(Record&&)>& use_;
  ReadRecording result_;
  bool has_metadata_ = false;
  std::map<std::uint16_t, RecordKind> kinds_;
  std::map<std::uint16_t, std::string> payloads_of_;
  Contexts contexts_;
  std::optional<Record> waiting_;
};

}  // namespace

ReadRecording read_recording(const std::string& path, Payloads payloads,
                             const std::function<void(Record&&)>& use,
                             const recording::Watch& watch) {
  return Reading(path, payloads, use).run(watch);
}

}  // namespace arbiter::evidence
