// What a recording, or a part of it, has for a replay: found by reading it once.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "evidence/records.hpp"
#include "recording/mcap.hpp"

namespace arbiter::recorder {

struct SurveyedSource {
  evidence::SourceContext type;  // its port's; of it, nothing else counts
  std::uint64_t largest = 1;     // sample
  std::uint64_t samples = 0;
  std::uint64_t payloads = 0;
  bool has_events = false;
  evidence::ActivityWord at_start = shm::kNeverActive;
  evidence::ActivityWord word = shm::kNeverActive;  // after what has been surveyed
  evidence::Nanoseconds timeout = shm::kForever;    // T when it was recorded
};

struct Survey {
  std::map<std::string, SurveyedSource> sources;
  std::map<std::string, std::set<std::string>> sources_of_ports;
  // Those that the recorder has only seen in the state that they have left, as an operator's. By
  // time.
  std::vector<evidence::Deactivation> untold;
  evidence::Nanoseconds first = 0;   // of the recording, or of the part
  evidence::Nanoseconds latest = 0;  // of its arrivals and deactivations
  // The number of the last record that is of the part: late news may stand far behind it.
  std::uint64_t last_event = 0;
};

// Of the part; `say` is told where the file is not whole. Throws McapError, RecordError.
[[nodiscard]] Survey survey(const std::string& file, const evidence::TimeSpan& part,
                            const std::function<void(const std::string&)>& say,
                            const recording::Watch& watch);

// By the rule of ports (Type).
[[nodiscard]] bool have_one_type(const evidence::SourceContext& one,
                                 const evidence::SourceContext& other);

}  // namespace arbiter::recorder
