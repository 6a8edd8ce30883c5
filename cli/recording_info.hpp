// What a recording's file has, and a whole file from one that is not.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <ostream>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "recording/mcap.hpp"

namespace arbiter::cli {

struct RecordingInfo {
  struct Times {
    recording::McapTime begin = 0;
    recording::McapTime end = 0;
  };
  struct Channel {
    std::uint16_t id = 0;
    recording::McapChannel channel;
    std::uint64_t messages = 0;
    std::uint64_t bytes = 0;     // of the messages
    std::optional<Times> times;  // of the messages

    // Whether its messages are samples, or whatever another program writes; not records of ours.
    [[nodiscard]] bool has_samples() const;
    // Messages per second; none of records, of fewer than two, or where all bear the same time.
    [[nodiscard]] std::optional<double> rate() const;
  };
  struct Chunks {
    std::uint64_t count = 0;
    std::uint64_t compressed = 0;
    std::uint64_t uncompressed = 0;
  };
  struct Unrecorded {
    std::string why;
    std::string text;
  };
  struct Attachment {
    std::string name;
    std::string media_type;
    recording::McapTime log_time = 0;
    std::uint64_t bytes = 0;
  };

  std::string path;
  recording::McapEnd end;
  bool has_header = false;  // else there is nothing of it to repair
  std::string profile;
  std::string library;
  std::uint64_t messages = 0;
  std::uint64_t missed_events = 0;   // by the recorder, as the file says
  std::uint64_t missed_samples = 0;  // whose payloads it missed
  std::optional<Times> times;
  std::map<std::string, Chunks> chunks;  // by compression
  std::map<std::uint16_t, recording::McapSchema> schemas;
  std::map<std::uint16_t, Channel> channels;
  std::vector<std::pair<std::string, recording::McapMap>> metadata;
  std::vector<Attachment> attachments;
  std::map<std::string, std::set<std::string>> imports;  // sources, and from which hosts they came
  std::size_t imported = 0;                              // of these, each with one host
  // Sources that were not recorded, or not from the beginning, and why: "refused", "stranger".
  std::map<std::string, Unrecorded> unrecorded;
  // What of all these, of metadata and attachments had no room.
  std::uint64_t unlisted = 0;
  std::size_t listed_bytes = 0;
};

// Reads all of it, so that each CRC is checked; says how far it is on standard error. Throws
// McapError.
[[nodiscard]] RecordingInfo inspect_recording(const std::string& path);

// "9999 bytes", "1.5 MiB".
[[nodiscard]] std::string size_text(std::uint64_t bytes);

// For 80 columns.
void write_text(std::ostream& out, const RecordingInfo& info);
[[nodiscard]] nlohmann::json to_json(const RecordingInfo& info);

// `arbiter recording info`: the exit code is 1 if the file is not whole.
int show_recording(const std::string& path, bool json);

// What to say to who would have one go to standard output.
inline constexpr const char* kMustBeFile =
    "a recording is a file, and cannot go to standard output; give it a name, such as "
    "incident.mcap";

// `arbiter recording repair`. `output`: empty for a name made from the path's.
int repair_recording(const std::string& path, const std::string& output);

}  // namespace arbiter::cli
