// What a file has, as lines that can be compared, and files to have it.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "recording/mcap.hpp"

namespace arbiter::test {

using recording::Compression;

inline std::string_view text_of(std::span<const std::byte> data) {
  return {reinterpret_cast<const char*>(data.data()), data.size()};
}

inline std::span<const std::byte> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::byte*>(text.data()), text.size()};
}

inline std::string text_of(const recording::McapMap& map) {
  std::string text;
  for (const auto& [key, value] : map) text.append(" ").append(key).append("=").append(value);
  return text;
}

inline std::string name_of(const testing::TestParamInfo<Compression>& info) {
  return std::array{"none", "lz4", "zstd"}[static_cast<std::size_t>(info.param)];
}

struct Contents {
  std::vector<std::string> lines;  // but headers and chunks
  std::vector<recording::McapChunkInfo> chunks;
  recording::McapEnd end;
};

inline Contents contents_of(const std::string& path,
                            std::size_t max_chunk_bytes = recording::kMaxChunkBytes) {
  Contents contents;
  auto& lines = contents.lines;
  recording::McapVisitor visitor;
  visitor.schema = [&](std::uint16_t id, const recording::McapSchema& schema) {
    lines.push_back("schema " + std::to_string(id) + " " + schema.name + " " + schema.encoding +
                    " " + schema.data);
  };
  visitor.channel = [&](std::uint16_t id, const recording::McapChannel& channel) {
    lines.push_back("channel " + std::to_string(id) + " " + std::to_string(channel.schema) + " " +
                    channel.topic + " " + channel.message_encoding + text_of(channel.metadata));
  };
  visitor.message = [&](const recording::McapMessage& message) {
    lines.push_back("message " + std::to_string(message.channel) + " " +
                    std::to_string(message.sequence) + " " + std::to_string(message.log_time) +
                    " " + std::to_string(message.publish_time) + " " +
                    std::string(text_of(message.data)));
  };
  visitor.metadata = [&](const std::string& name, const recording::McapMap& map) {
    lines.push_back("metadata " + name + text_of(map));
  };
  visitor.attachment = [&](const recording::McapAttachment& attachment) {
    lines.push_back("attachment " + attachment.name + " " + attachment.media_type + " " +
                    std::to_string(attachment.log_time) + " " + attachment.data);
  };
  visitor.chunk = [&](const recording::McapChunkInfo& chunk) { contents.chunks.push_back(chunk); };
  contents.end = recording::read_mcap(path, visitor, max_chunk_bytes);
  return contents;
}

inline std::string content_of_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline recording::McapMessage message(std::uint16_t channel, std::uint32_t sequence,
                                      std::string_view data) {
  return {channel, sequence, 1'000 + sequence, 900 + sequence, bytes_of(data)};
}

// One of everything; two chunks of three messages each, of which some do not compress.
inline std::vector<std::string> write_one_of_each(recording::McapWriter& writer) {
  const std::string payload(200, 'a');
  const auto schema = writer.add_schema({"arrival", "jsonschema", R"({"type":"object"})"});
  const auto arm = writer.add_channel({schema, "/Arm/pos:i", "json", {{"node", "Arm"}}});
  const auto raw = writer.add_channel({0, "/Camera/image:o", "raw", {}});
  writer.write_metadata("arbiter", {{"host", "robot"}, {"version", "1"}});
  writer.write(message(arm, 1, R"({"n":1})"));
  writer.write(message(raw, 2, payload));
  writer.write(message(arm, 3, ""));
  writer.write_attachment({"model.xml", "application/xml", 77, "<behaviors/>"});
  writer.write(message(raw, 4, payload));
  const auto late = writer.add_channel({0, "/Late:o", "raw", {}});
  writer.write(message(late, 6, payload));
  writer.write(message(late, 5, payload));
  writer.close();
  return {R"(schema 1 arrival jsonschema {"type":"object"})",
          "channel 1 1 /Arm/pos:i json node=Arm",
          "channel 2 0 /Camera/image:o raw",
          "metadata arbiter host=robot version=1",
          R"(message 1 1 1001 901 {"n":1})",
          "message 2 2 1002 902 " + payload,
          "message 1 3 1003 903 ",
          "attachment model.xml application/xml 77 <behaviors/>",
          "channel 3 0 /Late:o raw",
          "message 2 4 1004 904 " + payload,
          "message 3 6 1006 906 " + payload,
          "message 3 5 1005 905 " + payload};
}

}  // namespace arbiter::test
