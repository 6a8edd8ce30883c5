#include "evidence/record_json.hpp"

#include <charconv>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "evidence/activity_json.hpp"

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
    if (!value.is_number_unsigned()) fail(name, "is not a whole number of at least 0");
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
    const auto known = known_word(name, words);
    if (!known) fail(name, "is none of the words that it may be");
    return *known;
  }
  // The same, where a later version may have more of them; nothing: it is none of these.
  template <class Word>
  [[nodiscard]] std::optional<Word> known_word(const char* name,
                                               std::initializer_list<Word> words) const {
    for (const Word each : words) {
      if (name_of(each) == text(name)) return each;
    }
    return std::nullopt;
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
  each.why = in.known_word<Why>("why", {Why::overtaken, Why::queue, Why::refused, Why::stranger,
                                        Why::too_large, Why::memory})
                 .value_or(Why::other);
  each.text = in.text("text");
  return each;
}

// Names, values, and where objects and lists begin and end: of a model, some for each file.
constexpr std::size_t kMostParts = std::size_t{64} << 10;

json parse_record(RecordKind kind, std::string_view text) {
  if (text.size() > max_record_bytes(kind)) {
    throw RecordError("it has " + std::to_string(text.size()) + " bytes, more than the " +
                      std::to_string(max_record_bytes(kind)) + " that it may have");
  }
  if (kind != RecordKind::kModel) return json::parse(text, nullptr, false);
  std::size_t parts = 0;
  const auto judge = [&parts](int /*depth*/, json::parse_event_t /*event*/, json& /*parsed*/) {
    if (++parts > kMostParts) {
      throw RecordError("it has more than " + std::to_string(kMostParts) + " parts");
    }
    return true;
  };
  return json::parse(text, judge, false);
}

}  // namespace

Record read_record(RecordKind kind, std::string_view text, Contexts& contexts) {
  const json object = parse_record(kind, text);
  if (!object.is_object()) throw RecordError("it is not a JSON object");
  const Fields in(object);
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

}  // namespace arbiter::evidence
