// What Arbiter writes, another's library reads, and the other way round: @mcap/core, with which the
// field's tools are made.
// `./run test` installs it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <random>

#include <nlohmann/json.hpp>

#include "recording/mcap_chunk.hpp"
#include "tests/recording/contents.hpp"
#include "tests/support/run_program.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

using nlohmann::json;
using recording::McapWriter;

// As read_with_peer.mjs has it.
struct Found {
  json schemas = json::array();
  json channels = json::array();
  json messages = json::array();
  json metadata = json::array();
  json attachments = json::array();
  std::map<std::uint16_t, int> counts;
};

Found read_by_ourselves(const std::string& path) {
  Found found;
  recording::McapVisitor visitor;
  visitor.schema = [&](std::uint16_t id, const recording::McapSchema& schema) {
    found.schemas.push_back(
        {{"id", id}, {"name", schema.name}, {"encoding", schema.encoding}, {"data", schema.data}});
  };
  visitor.channel = [&](std::uint16_t id, const recording::McapChannel& channel) {
    found.channels.push_back({{"id", id},
                              {"schema", channel.schema},
                              {"topic", channel.topic},
                              {"encoding", channel.message_encoding},
                              {"metadata", channel.metadata}});
  };
  visitor.message = [&](const recording::McapMessage& message) {
    ++found.counts[message.channel];
    found.messages.push_back({{"channel", message.channel},
                              {"sequence", message.sequence},
                              {"log_time", std::to_string(message.log_time)},
                              {"publish_time", std::to_string(message.publish_time)},
                              {"data", std::string(text_of(message.data))}});
  };
  visitor.metadata = [&](const std::string& name, const recording::McapMap& map) {
    found.metadata.push_back({{"name", name}, {"metadata", map}});
  };
  visitor.attachment = [&](const recording::McapAttachment& attachment) {
    found.attachments.push_back({{"name", attachment.name},
                                 {"media_type", attachment.media_type},
                                 {"log_time", std::to_string(attachment.log_time)},
                                 {"data", attachment.data}});
  };
  EXPECT_TRUE(recording::read_mcap(path, visitor).is_whole);
  return found;
}

constexpr const char* kNeeds = "\nThe peer needs node, and in " ARBITER_PEER
                               " what `npm ci` installs: `./run test` sees to both.";

ProgramResult run_peer(const std::string& path) {
  return run_program({"/usr/bin/env", "node", ARBITER_PEER "/read_with_peer.mjs", path});
}

json read_by_peer(const std::string& path) {
  const ProgramResult result = run_peer(path);
  if (result.exit_code == 0) return json::parse(result.out);
  ADD_FAILURE() << result.err << "\nThe reader needs node, and in " ARBITER_PEER
                << " what `npm ci` installs: `./run test` sees to both.";
  return {};
}

json sorted_by_time(json messages) {
  std::stable_sort(messages.begin(), messages.end(), [](const json& a, const json& b) {
    return std::stoull(a["log_time"].get<std::string>()) <
           std::stoull(b["log_time"].get<std::string>());
  });
  return messages;
}

void expect_peer_agrees(const Found& ours, const json& stream) {
  EXPECT_EQ(stream["schemas"], ours.schemas);
  EXPECT_EQ(stream["channels"], ours.channels);
  EXPECT_EQ(stream["messages"], ours.messages);
  EXPECT_EQ(stream["metadata"], ours.metadata);
  EXPECT_EQ(stream["attachments"], ours.attachments);
}

void expect_peer_agrees(const std::string& path) {
  const Found ours = read_by_ourselves(path);
  const json peer = read_by_peer(path);
  ASSERT_TRUE(peer.is_object());
  expect_peer_agrees(ours, peer["from_beginning"]);
  const json& index = peer["by_index"];
  EXPECT_EQ(index["schemas"], ours.schemas);
  EXPECT_EQ(index["channels"], ours.channels);
  EXPECT_EQ(index["messages"], sorted_by_time(ours.messages));
  EXPECT_EQ(index["metadata"], ours.metadata);
  EXPECT_EQ(index["attachments"], ours.attachments);
  const json& statistics = index["statistics"];
  EXPECT_EQ(statistics["messages"], ours.messages.size());
  EXPECT_EQ(statistics["schemas"], ours.schemas.size());
  EXPECT_EQ(statistics["channels"], ours.channels.size());
  EXPECT_EQ(statistics["metadata"], ours.metadata.size());
  EXPECT_EQ(statistics["attachments"], ours.attachments.size());
  EXPECT_EQ(statistics["chunks"], index["compressions"].size());
  json counts = json::object();
  for (const auto& [id, count] : ours.counts) counts[std::to_string(id)] = count;
  EXPECT_EQ(statistics["counts"], counts);
  if (ours.messages.empty()) return;
  const json by_time = sorted_by_time(ours.messages);
  EXPECT_EQ(statistics["begin"], by_time.front()["log_time"]);
  EXPECT_EQ(statistics["end"], by_time.back()["log_time"]);
}

class Peer : public testing::Test {
 protected:
  TemporaryDirectory directory_;
  std::string path_ = directory_.file("a.mcap");
};

class PeerOfEachCompression : public Peer, public testing::WithParamInterface<Compression> {};

TEST_P(PeerOfEachCompression, ReadsWhatWeWrite) {
  McapWriter writer(path_, "arbiter test", {GetParam()});
  write_one_of_each(writer);
  expect_peer_agrees(path_);
  const json peer = read_by_peer(path_)["by_index"];
  const std::map<Compression, std::string> names{
      {Compression::none, ""}, {Compression::lz4, "lz4"}, {Compression::zstd, "zstd"}};
  EXPECT_EQ(peer["compressions"], json::array({names.at(GetParam()), names.at(GetParam())}));
  EXPECT_EQ(peer["library"], "arbiter test");
  EXPECT_EQ(peer["groups"], json({0x03, 0x04, 0x08, 0x0A, 0x0B, 0x0D}));
}

INSTANTIATE_TEST_SUITE_P(Mcap, PeerOfEachCompression,
                         testing::Values(Compression::none, Compression::lz4, Compression::zstd),
                         name_of);

TEST_F(Peer, ReadsAFileWithoutMessages) {
  McapWriter writer(path_, "test", {});
  writer.add_channel({writer.add_schema({"s", "jsonschema", "{}"}), "/a", "json", {}});
  writer.close();
  expect_peer_agrees(path_);
}

TEST_F(Peer, ReadsManyChunksAndMixedCompressions) {
  McapWriter writer(path_, "test", {Compression::zstd, 4'000});
  for (int i = 0; i < 20; ++i) writer.add_channel({0, "/a" + std::to_string(i), "json", {}});
  std::mt19937 random(1);  // the same file each time
  for (std::uint32_t i = 0; i < 2'000; ++i) {
    const std::string data(random() % 300, static_cast<char>('a' + i % 26));
    auto next = message(static_cast<std::uint16_t>(1 + random() % 20), i, data);
    next.log_time = i + random() % 50;
    writer.write(next);
  }
  recording::McapChunkBuilder kept(Compression::lz4);
  kept.write(message(3, 1, std::string(1'000, 'x')));
  writer.append(kept.close());
  kept.write(message(4, 1, "short"));
  writer.append(kept.close());
  writer.close();
  expect_peer_agrees(path_);
  EXPECT_THAT(contents_of(path_).chunks, testing::SizeIs(testing::Gt(50)));
}

TEST_F(Peer, ReadsWhatWasRepaired) {
  const std::string sample = directory_.file("sample.mcap");
  McapWriter writer(sample, "test", {Compression::lz4});
  write_one_of_each(writer);
  const std::string content = content_of_file(sample);
  const std::uint64_t second = contents_of(sample).chunks[1].offset;
  // Behind the first chunk, within it and within what indexes it.
  for (const std::uint64_t size : {second + 100, second - 30, second}) {
    std::filesystem::remove(path_);
    recording::repair_mcap(directory_.write("from.mcap", content.substr(0, size)), path_, "test");
    expect_peer_agrees(path_);
  }
}

// Files of the peer: with and without chunks, indexes, CRCs and compression; in chunks, and again
// at the end, schemas and channels, of which the first has the number 0.
TEST_F(Peer, WritesWhatWeRead) {
  for (const char* options :
       {"{}", R"({"useChunks": false})", R"({"zstd": true, "chunkSize": 1000})",
        R"({"useMessageIndex": false, "useChunkIndex": false, "useSummaryOffsets": false})",
        R"({"useStatistics": false, "repeatSchemas": false, "repeatChannels": false,
            "useMetadataIndex": false, "useAttachmentIndex": false, "useChunkIndex": false})"}) {
    SCOPED_TRACE(options);
    const ProgramResult written =
        run_program({"/usr/bin/env", "node", ARBITER_PEER "/write_with_peer.mjs", path_, options});
    ASSERT_EQ(written.exit_code, 0) << written.err << kNeeds;
    const Found ours = read_by_ourselves(path_);
    EXPECT_EQ(ours.messages.size(), 100U);
    EXPECT_EQ(ours.messages[99]["data"], std::string(99, 'x'));
    EXPECT_EQ(ours.channels[0]["id"], 0);
    EXPECT_EQ(ours.attachments[0]["data"], "attached");
    // Cut off and repaired, it has an index that the peer reads; what the peer left out is there.
    const std::string content = content_of_file(path_);
    const std::size_t data_end = content.rfind(std::string("\x0F\x04\0\0\0\0\0\0\0", 9));
    ASSERT_NE(data_end, std::string::npos);
    const std::string to = directory_.file("repaired.mcap");
    std::filesystem::remove(to);
    recording::repair_mcap(directory_.write("cut.mcap", content.substr(0, data_end)), to, "test");
    const json repaired = read_by_peer(to);
    ASSERT_TRUE(repaired.is_object());
    expect_peer_agrees(read_by_ourselves(to), repaired["from_beginning"]);
    EXPECT_EQ(repaired["by_index"]["statistics"]["messages"], 100);
    EXPECT_EQ(repaired["by_index"]["statistics"]["schemas"], 1);
    const bool is_indexed = !repaired["by_index"]["compressions"].empty();
    EXPECT_EQ(repaired["by_index"]["messages"].size(), is_indexed ? 100U : 0U);
  }
}

// The peer judges: it refuses what is damaged.
TEST_F(Peer, RefusesADamagedFile) {
  McapWriter writer(path_, "test", {Compression::none});
  write_one_of_each(writer);
  std::string content = content_of_file(path_);
  content[content.find(std::string(200, 'a')) + 7] = 'b';
  const ProgramResult result = run_peer(directory_.write("damaged.mcap", content));
  EXPECT_NE(result.exit_code, 0);
  EXPECT_THAT(result.err, testing::HasSubstr("CRC"));
}

}  // namespace
}  // namespace arbiter::test
