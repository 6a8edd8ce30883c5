#include "evidence/record_reader.hpp"

#include <algorithm>
#include <charconv>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "evidence/record_json.hpp"
#include "evidence/record_schemas.hpp"

namespace arbiter::evidence {
namespace {

// An event as the file has it.
struct PassedEvent {
  RecordKind kind{};
  std::uint64_t number = 0;  // of all records; 0: none
  std::string text;
};

// The source of an event, as JSON writes it; nothing: it does not stand where RecordWriter has it.
std::optional<std::string_view> quoted_source(std::string_view text) {
  constexpr std::string_view kBefore = R"({"source":")";
  if (!text.starts_with(kBefore)) return std::nullopt;
  text.remove_prefix(kBefore.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"') return text.substr(0, i);
    if (text[i] == '\\') ++i;
  }
  return std::nullopt;
}

// Those that were passed over and may have to be handed on: to read them takes twenty times as
// long. Of each source, before the part and behind it, the last arrival, and the first deactivation
// behind that: to deactivate once more changes nothing.
class PassedEvents {
 public:
  void put(std::string_view source, bool is_behind, PassedEvent event) {
    auto found = of_sources_.find(source);
    if (found == of_sources_.end()) found = of_sources_.emplace(source, OfSource{}).first;
    auto& [arrival, deactivation] = is_behind ? found->second.behind : found->second.before;
    if (event.kind == RecordKind::kArrival) {
      arrival = std::move(event);
      deactivation.number = 0;
    } else if (deactivation.number == 0) {
      deactivation = std::move(event);
    }
  }
  // Those of one source, or of all, in the order in which they stand in the file.
  [[nodiscard]] std::vector<PassedEvent> take(std::string_view source) {
    std::vector<PassedEvent> all;
    const auto found = of_sources_.find(source);
    if (found == of_sources_.end()) return all;
    add(found->second, all);
    of_sources_.erase(found);
    return sorted(std::move(all));
  }
  [[nodiscard]] std::vector<PassedEvent> take_all() {
    std::vector<PassedEvent> all;
    for (auto& [source, events] : of_sources_) add(events, all);
    of_sources_.clear();
    return sorted(std::move(all));
  }

 private:
  struct Side {
    PassedEvent arrival;
    PassedEvent deactivation;
  };
  struct OfSource {
    Side before;
    Side behind;
  };

  static void add(OfSource& events, std::vector<PassedEvent>& all) {
    for (Side* const side : {&events.before, &events.behind}) {
      for (PassedEvent* const each : {&side->arrival, &side->deactivation}) {
        if (each->number != 0) all.push_back(std::move(*each));
      }
    }
  }
  static std::vector<PassedEvent> sorted(std::vector<PassedEvent> all) {
    std::sort(all.begin(), all.end(),
              [](const auto& one, const auto& other) { return one.number < other.number; });
    return all;
  }

  std::map<std::string, OfSource, std::less<>> of_sources_;
};

// What is longer is read at once, for of that little is kept: names are shorter.
constexpr std::size_t kMostKept = 4096;

// Whether what it says of its source, or of all, may rest on the events before it.
bool rests_on_events(RecordKind kind) {
  return kind != RecordKind::kWinner && kind != RecordKind::kPort && kind != RecordKind::kModel;
}

class Reading {
 public:
  Reading(const std::string& path, Payloads payloads, const std::function<void(Record&&)>& use,
          const TimeSpan& events)
      : path_(path), payloads_(payloads), use_(use), events_(events) {}

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
    hand_on(passed_.take_all());
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
    const std::string_view text(reinterpret_cast<const char*>(message.data.data()),
                                message.data.size());
    const bool is_event =
        kind->second == RecordKind::kArrival || kind->second == RecordKind::kDeactivation;
    ++result_.records;
    if (is_event && pass_over(kind->second, message, text)) {
      hand_on();
      return;
    }
    if (rests_on_events(kind->second)) {
      const auto source = quoted_source(text);
      hand_on(source ? passed_.take(*source) : passed_.take_all());
    }
    read(kind->second, text, result_.records);
  }

  bool pass_over(RecordKind kind, const recording::McapMessage& message, std::string_view text) {
    const auto time = static_cast<Nanoseconds>(message.log_time -
                                               static_cast<std::uint64_t>(result_.wall_offset));
    if (events_.has(time) || text.size() > kMostKept) return false;
    const auto source = quoted_source(text);
    if (!source) return false;
    passed_.put(*source, time >= events_.to, {kind, result_.records, std::string(text)});
    return true;
  }

  void read(RecordKind kind, std::string_view text, std::uint64_t number) {
    hand_on();
    try {
      waiting_ = read_record(kind, text, contexts_);
    } catch (const RecordError& error) {
      throw RecordError(path_ + ": record " + std::to_string(number) + ", of topic " +
                        std::string(record_schemas[static_cast<std::size_t>(kind)].topic) + ": " +
                        error.what());
    }
  }

  void hand_on(const std::vector<PassedEvent>& passed) {
    for (const PassedEvent& each : passed) read(each.kind, each.text, each.number);
  }

  // It stands directly behind its arrival.
  void take_payload(const std::string& source, const recording::McapMessage& message) {
    if (payloads_ != Payloads::read || !waiting_) return;
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
  const Payloads payloads_;
  const std::function<void(Record&&)>& use_;
  ReadRecording result_;
  bool has_metadata_ = false;
  std::map<std::uint16_t, RecordKind> kinds_;
  std::map<std::uint16_t, std::string> payloads_of_;
  Contexts contexts_;
  std::optional<Record> waiting_;
  const TimeSpan events_;
  PassedEvents passed_;
};

}  // namespace

ReadRecording read_recording(const std::string& path, Payloads payloads,
                             const std::function<void(Record&&)>& use,
                             const recording::Watch& watch, const TimeSpan& events) {
  return Reading(path, payloads, use, events).run(watch);
}

}  // namespace arbiter::evidence
