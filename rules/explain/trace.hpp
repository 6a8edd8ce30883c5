// A trace: what arrived when, as CSV with the header t_ns,source or t_ns,source,event.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "rules/text/diagnostic.hpp"
#include "rules/text/text_file.hpp"
#include "shm/activity.hpp"

namespace arbiter::rules {

// A trace may be longer than a model, but is read as a whole.
inline constexpr std::size_t kMaxTraceBytes = 64u << 20;
inline constexpr std::size_t kMaxTraceEvents = 4u << 20;

enum class TraceKind : std::uint8_t {
  kArrival,
  kDeactivation,
  kTick,  // nothing happens but that time has passed; no source
};

struct TraceEvent {
  shm::Nanoseconds at = 0;
  TraceKind kind = TraceKind::kArrival;
  std::string source;
  std::uint32_t line = 1;  // of the source, in the trace's file
  std::uint32_t column = 1;
};

// Reports all problems in one go; the result is to be used only if there is no error.
std::vector<TraceEvent> parse_trace(const TextFile& file, Diagnostics& diagnostics,
                                    std::size_t max_events = kMaxTraceEvents);

// Throws FileError.
std::vector<TraceEvent> read_trace(const std::string& path, Diagnostics& diagnostics);

}  // namespace arbiter::rules
