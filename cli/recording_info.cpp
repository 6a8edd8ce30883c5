#include "cli/recording_info.hpp"

#include <algorithm>
#include <filesystem>
#include <iostream>

#include <nlohmann/json.hpp>

#include "cli/output_file.hpp"
#include "cli/progress.hpp"
#include "evidence/record_schemas.hpp"
#include "shm/utf8.hpp"
#include "wire/document.hpp"

namespace arbiter::cli {
namespace {

using recording::McapTime;

// Of a file that has nothing else, memory would be full of them.
constexpr std::size_t kMostListed = 1'000;
constexpr std::size_t kMostListedBytes = std::size_t{64} << 20;

// Whether one more is listed, which takes so much.
bool has_room(RecordingInfo& info, std::size_t listed, std::size_t bytes) {
  if (listed >= kMostListed || bytes > kMostListedBytes - info.listed_bytes) {
    ++info.unlisted;
    return false;
  }
  info.listed_bytes += bytes;
  return true;
}

std::size_t bytes_of(const recording::McapMap& map) {
  constexpr std::size_t kEntry = 128;  // for what the map itself takes
  std::size_t bytes = 0;
  for (const auto& [key, value] : map) bytes += kEntry + key.size() + value.size();
  return bytes;
}

void include(std::optional<RecordingInfo::Times>& times, McapTime time) {
  if (!times) times = {time, time};
  times->begin = std::min(times->begin, time);
  times->end = std::max(times->end, time);
}

// A record of that kind. Of a file that only looks like a recording, nothing; nor is a record read
// that is too large.
nlohmann::json record_of(evidence::RecordKind kind, const recording::McapChannel& channel,
                         const recording::McapMessage& message) {
  const auto& topic = evidence::record_schemas[static_cast<std::size_t>(kind)].topic;
  if (channel.topic != topic || channel.message_encoding != "json" ||
      message.data.size() > evidence::max_record_bytes(kind)) {
    return nullptr;
  }
  return nlohmann::json::parse(message.data, nullptr, false);
}

// Empty: it has no such field.
std::string text_of(const nlohmann::json& record, const char* name) {
  if (!record.is_object()) return {};
  const auto found = record.find(name);
  return found != record.end() && found->is_string() ? found->get<std::string>() : "";
}

void count_missed(RecordingInfo& info, const recording::McapChannel& channel,
                  const recording::McapMessage& message) {
  const auto record = record_of(evidence::RecordKind::kMissed, channel, message);
  const auto number = [&record](const char* name) -> std::uint64_t {
    if (!record.is_object()) return 0;
    const auto found = record.find(name);
    const bool is_number = found != record.end() && found->is_number_unsigned();
    return is_number ? found->get<std::uint64_t>() : 0;
  };
  info.missed_events += number("events");
  info.missed_samples += number("samples");
  const std::string source = text_of(record, "source");
  const std::string why = text_of(record, "why");
  if (why != "refused" && why != "stranger") return;
  const std::string text = text_of(record, "text");
  const auto known = info.unrecorded.find(source);
  if (known != info.unrecorded.end()) {
    if (text.size() <= known->second.text.size()) known->second = {why, text};
  } else if (has_room(info, info.unrecorded.size(), source.size() + text.size())) {
    info.unrecorded[source] = {why, text};
  }
}

void note_import(RecordingInfo& info, const recording::McapChannel& channel,
                 const recording::McapMessage& message) {
  const auto record = record_of(evidence::RecordKind::kPort, channel, message);
  const std::string source = text_of(record, "port");
  const std::string host = text_of(record, "host");
  const auto known = info.imports.find(source);
  if (host.empty() || (known != info.imports.end() && known->second.contains(host))) return;
  if (has_room(info, info.imported, source.size() + host.size())) {
    info.imports[source].insert(host);
    ++info.imported;
  }
}

void count_message(RecordingInfo& info, const recording::McapMessage& message) {
  ++info.messages;
  include(info.times, message.log_time);
  auto& channel = info.channels[message.channel];
  ++channel.messages;
  channel.bytes += message.data.size();
  include(channel.times, message.log_time);
  count_missed(info, channel.channel, message);
  note_import(info, channel.channel, message);
}

recording::McapVisitor visitor_for(RecordingInfo& info) {
  recording::McapVisitor visitor;
  visitor.header = [&info](const std::string& profile, const std::string& library) {
    info.has_header = true;
    info.profile = profile;
    info.library = library;
  };
  visitor.schema = [&info](std::uint16_t id, const recording::McapSchema& schema) {
    info.schemas.emplace(id, schema);
  };
  visitor.channel = [&info](std::uint16_t id, const recording::McapChannel& channel) {
    info.channels.try_emplace(id, RecordingInfo::Channel{id, channel, 0, 0, {}});
  };
  visitor.message = [&info](const recording::McapMessage& message) {
    count_message(info, message);
  };
  visitor.metadata = [&info](const std::string& name, const recording::McapMap& map) {
    if (!has_room(info, info.metadata.size(), name.size() + bytes_of(map))) return;
    info.metadata.emplace_back(name, map);
  };
  visitor.attachment = [&info](const recording::McapAttachment& attachment) {
    const std::size_t bytes = attachment.name.size() + attachment.media_type.size();
    if (!has_room(info, info.attachments.size(), bytes)) return;
    info.attachments.push_back(
        {attachment.name, attachment.media_type, attachment.log_time, attachment.data.size()});
  };
  return visitor;
}

nlohmann::json time_json(const std::optional<RecordingInfo::Times>& times, bool begin) {
  if (!times) return nullptr;
  return begin ? times->begin : times->end;
}

std::string name_for(const std::string& path) {
  namespace fs = std::filesystem;
  const fs::path from(path);
  return (from.parent_path() / (from.stem().string() + ".repaired.mcap")).string();
}

}  // namespace

// How often winners change, or ports are opened, is no frequency.
bool RecordingInfo::Channel::has_samples() const {
  const auto& records = evidence::record_schemas;
  return std::none_of(records.begin(), records.end(), [this](const evidence::RecordSchema& record) {
    return channel.topic == record.topic && channel.message_encoding == "json";
  });
}

std::optional<double> RecordingInfo::Channel::rate() const {
  if (!has_samples() || messages < 2 || times->begin == times->end) return std::nullopt;
  return static_cast<double>(messages - 1) * 1e9 / static_cast<double>(times->end - times->begin);
}

RecordingInfo inspect_recording(const std::string& path) {
  RecordingInfo info;
  info.path = path;
  ProgressLine line;
  recording::McapVisitor visitor = visitor_for(info);
  visitor.watch = line.watch("reading the recording");
  visitor.chunk = [&](const recording::McapChunkInfo& chunk) {
    auto& sum = info.chunks[chunk.compression];
    ++sum.count;
    sum.compressed += chunk.compressed;
    sum.uncompressed += chunk.uncompressed;
  };
  info.end = recording::read_mcap(path, visitor);
  return info;
}

nlohmann::json to_json(const RecordingInfo& info) {
  using nlohmann::json;
  json channels = json::array();
  for (const auto& [id, each] : info.channels) {
    const auto rate = each.rate();
    channels.push_back({{"id", id},
                        {"topic", each.channel.topic},
                        {"schema", each.channel.schema},
                        {"message_encoding", each.channel.message_encoding},
                        {"metadata", each.channel.metadata},
                        {"messages", each.messages},
                        {"bytes", each.bytes},
                        {"begin", time_json(each.times, true)},
                        {"end", time_json(each.times, false)},
                        {"rate", rate ? json(*rate) : json()}});
  }
  json schemas = json::array();
  for (const auto& [id, schema] : info.schemas) {
    schemas.push_back(
        {{"id", id}, {"name", schema.name}, {"encoding", schema.encoding}, {"data", schema.data}});
  }
  json chunks = json::array();
  for (const auto& [compression, sum] : info.chunks) {
    chunks.push_back({{"compression", compression.empty() ? "none" : compression},
                      {"count", sum.count},
                      {"compressed", sum.compressed},
                      {"uncompressed", sum.uncompressed}});
  }
  json metadata = json::array();
  for (const auto& [name, values] : info.metadata) {
    metadata.push_back({{"name", name}, {"values", values}});
  }
  json imports = json::array();
  for (const auto& [source, hosts] : info.imports) {
    imports.push_back({{"source", source}, {"hosts", hosts}});
  }
  json unrecorded = json::array();
  for (const auto& [source, each] : info.unrecorded) {
    unrecorded.push_back({{"source", source}, {"why", each.why}, {"text", each.text}});
  }
  json attachments = json::array();
  for (const auto& each : info.attachments) {
    attachments.push_back({{"name", each.name},
                           {"media_type", each.media_type},
                           {"log_time", each.log_time},
                           {"bytes", each.bytes}});
  }
  const bool is_whole = info.end.is_whole;
  return {{"file", info.path},
          {"bytes", info.end.file_bytes},
          {"is_whole", is_whole},
          {"whole_bytes", info.end.whole_bytes},
          {"problem", is_whole ? json() : json(info.end.problem)},
          {"has_summary", info.end.has_summary},
          {"profile", info.profile},
          {"library", info.library},
          {"messages", info.messages},
          {"missed_events", info.missed_events},
          {"missed_samples", info.missed_samples},
          {"begin", time_json(info.times, true)},
          {"end", time_json(info.times, false)},
          {"chunks", std::move(chunks)},
          {"schemas", std::move(schemas)},
          {"channels", std::move(channels)},
          {"imports", std::move(imports)},
          {"unrecorded", std::move(unrecorded)},
          {"metadata", std::move(metadata)},
          {"attachments", std::move(attachments)},
          {"unlisted", info.unlisted}};
}

int show_recording(const std::string& path, bool json) {
  const RecordingInfo info = inspect_recording(path);
  if (json) {
    std::cout << wire::write_document(to_json(info));
  } else {
    write_text(std::cout, info);
  }
  return info.end.is_whole ? 0 : 1;
}

int repair_recording(const std::string& path, const std::string& output) {
  require_named_file(output, kMustBeFile);
  const RecordingInfo before = inspect_recording(path);
  if (before.end.is_whole && before.end.has_summary) {
    std::cout << shm::printable(path) << " is whole; nothing was written\n";
    return 0;
  }
  const std::string to = output.empty() ? name_for(path) : output;
  ProgressLine line;
  const auto end = recording::repair_mcap(path, to, "arbiter " ARBITER_VERSION,
                                          recording::kMaxChunkBytes, line.watch("repairing"));
  line.clear();
  std::cout << "wrote " << shm::printable(to) << ": " << before.messages
            << (before.messages == 1 ? " message" : " messages") << ", from the first "
            << end.whole_bytes << " of " << end.file_bytes << " bytes\n";
  if (!end.is_whole) {
    std::cout << "behind them, " << end.problem << '\n';
  }
  return 0;
}

}  // namespace arbiter::cli
