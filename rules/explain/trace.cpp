#include "rules/explain/trace.hpp"

#include <algorithm>
#include <charconv>
#include <optional>
#include <utility>

#include "rules/text/csv.hpp"
#include "rules/text/names.hpp"

namespace arbiter::rules {
namespace {

constexpr std::size_t kTimeAt = 0, kSourceAt = 1, kEventAt = 2;

class TraceParser {
 public:
  TraceParser(const TextFile& file, Diagnostics& diagnostics)
      : file_(file), diagnostics_(diagnostics), records_(file, diagnostics) {}

  std::vector<TraceEvent> parse(std::size_t max_events);

 private:
  bool read_header();
  std::optional<TraceEvent> read_event(const CsvRecord& record);
  std::optional<shm::Nanoseconds> read_time(const CsvField& field);
  std::optional<TraceKind> read_kind(const CsvRecord& record);
  void error(const char* code, const CsvField& field, std::string message);

  const TextFile& file_;
  Diagnostics& diagnostics_;
  CsvReader records_;
  std::size_t columns_ = 0;
  shm::Nanoseconds last_time_ = 0;
};

void TraceParser::error(const char* code, const CsvField& field, std::string message) {
  diagnostics_.error(code, file_.locate(field.offset), std::move(message));
}

std::vector<TraceEvent> TraceParser::parse(std::size_t max_events) {
  std::vector<TraceEvent> events;
  if (!check_size(file_, kMaxTraceBytes, diagnostics_) || !read_header()) return events;
  while (const auto record = records_.next()) {
    if (events.size() == max_events) {
      error("limit-exceeded", record->front(),
            "the trace has more events than the limit of " + std::to_string(max_events) +
                "; split it into several");
      break;
    }
    if (auto event = read_event(*record)) events.push_back(std::move(*event));
  }
  return events;
}

bool TraceParser::read_header() {
  static constexpr const char* kHint =
      "a trace begins with the line t_ns,source or t_ns,source,event";
  const auto record = records_.next();
  if (!record) {
    if (!diagnostics_.has_errors()) {
      error("trace-header", {}, std::string("the trace is empty; ") + kHint);
    }
    return false;
  }
  static constexpr const char* kColumns[] = {"t_ns", "source", "event"};
  columns_ = record->size();
  bool is_header = columns_ == 2 || columns_ == 3;
  for (std::size_t i = 0; is_header && i < columns_; ++i) {
    is_header = (*record)[i].value == kColumns[i];
  }
  if (!is_header) {
    const bool is_recording = record->front().value.find("MCAP") == 1;
    error("trace-header", record->front(),
          is_recording ? "this is a recording, not a trace; arbiter replay takes it, and arbiter "
                         "simulate --recording"
                       : std::string("this is not the header of a trace; ") + kHint);
  }
  return is_header;
}

std::optional<TraceEvent> TraceParser::read_event(const CsvRecord& record) {
  if (record.size() != columns_) {
    error("trace-fields", record[std::min(record.size() - 1, columns_)],
          "this line has " + counted(record.size(), "field") + ", and the header " +
              std::to_string(columns_) +
              (record.size() == 3 ? "; write t_ns,source,event as the header"
                                  : "; write as many in each line"));
    return std::nullopt;
  }
  const auto time = read_time(record[kTimeAt]);
  const auto kind = read_kind(record);
  if (!time || !kind) return std::nullopt;
  const auto& source = record[kSourceAt];
  const Location where = file_.locate(source.offset);
  return TraceEvent{*time, *kind, source.value, where.line, where.column};
}

std::optional<shm::Nanoseconds> TraceParser::read_time(const CsvField& field) {
  const std::string& text = field.value;
  const bool is_number = !text.empty() && std::all_of(text.begin(), text.end(),
                                                      [](char c) { return c >= '0' && c <= '9'; });
  if (!is_number) {
    error("trace-time", field,
          "the time " + quote(text) +
              " is not a whole number of nanoseconds from 0 up; half a second is 500000000");
    return std::nullopt;
  }
  shm::Nanoseconds time = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), time);
  if (problem != std::errc() || time > shm::kMaxTime) {
    error("trace-time", field,
          "the time " + text + " is beyond the last one, " + std::to_string(shm::kMaxTime));
    return std::nullopt;
  }
  if (time < last_time_) {
    error("trace-order", field,
          "the time " + text + " lies before that of an earlier line, " +
              std::to_string(last_time_) + "; sort the trace by time");
    return std::nullopt;
  }
  last_time_ = time;
  return time;
}

std::optional<TraceKind> TraceParser::read_kind(const CsvRecord& record) {
  const bool has_source = !record[kSourceAt].value.empty();
  const std::string event = columns_ > kEventAt ? record[kEventAt].value : std::string();
  if (event.empty() || event == "arrive") {
    return has_source ? TraceKind::kArrival : TraceKind::kTick;
  }
  if (event != "deactivate") {
    error("trace-event", record[kEventAt],
          "the event " + quote(event) + " is unknown; write arrive, deactivate or nothing");
    return std::nullopt;
  }
  if (!has_source) {
    error("trace-source", record[kSourceAt], "a deactivation needs the source that it is of");
    return std::nullopt;
  }
  return TraceKind::kDeactivation;
}

}  // namespace

std::vector<TraceEvent> parse_trace(const TextFile& file, Diagnostics& diagnostics,
                                    std::size_t max_events) {
  return TraceParser(file, diagnostics).parse(max_events);
}

std::vector<TraceEvent> read_trace(const std::string& path, Diagnostics& diagnostics) {
  const TextFile file(path, read_bytes(path, kMaxTraceBytes));
  return parse_trace(file, diagnostics);
}

}  // namespace arbiter::rules
