// From a file that ends early comes one that is whole, with all that the first one has.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "recording/records.hpp"
#include "tests/recording/contents.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

using recording::McapError;
using recording::repair_mcap;
using testing::HasSubstr;
using testing::StartsWith;

class Repair : public testing::Test {
 protected:
  Repair() {
    recording::McapWriter writer(sample_, "test", {Compression::lz4});
    write_one_of_each(writer);
    content_ = content_of_file(sample_);
  }

  TemporaryDirectory directory_;
  std::string sample_ = directory_.file("sample.mcap");
  std::string to_ = directory_.file("to.mcap");
  std::string content_;
};

TEST_F(Repair, KeepsWhatIsWholeWhereverTheFileEnds) {
  // Not all of them: each new file is made durable, which takes a disk its time.
  for (std::size_t size = 0; size < content_.size(); size += 7) {
    const std::string from = directory_.write("from.mcap", content_.substr(0, size));
    Contents before = contents_of(from);
    std::filesystem::remove(to_);
    if (before.end.whole_bytes <= recording::kMagic.size()) {
      ASSERT_THROW(repair_mcap(from, to_, "test"), McapError) << size;
      ASSERT_FALSE(std::filesystem::exists(to_)) << size;
      continue;
    }
    const auto end = repair_mcap(from, to_, "mender");
    ASSERT_EQ(end.whole_bytes, before.end.whole_bytes);
    Contents after = contents_of(to_);
    ASSERT_TRUE(after.end.is_whole) << size << ": " << after.end.problem;
    ASSERT_TRUE(after.end.has_summary);
    ASSERT_EQ(after.chunks.size(), before.chunks.size());
    ASSERT_THAT(after.lines.back(), StartsWith("metadata repaired by=mender lost_bytes="));
    after.lines.pop_back();
    ASSERT_EQ(after.lines, before.lines) << size;
  }
}

TEST_F(Repair, MakesTheSameSummaryAgain) {
  const std::size_t data_end = content_.find(std::string("\x0F\x04\0\0\0\0\0\0\0", 9));
  ASSERT_NE(data_end, std::string::npos);
  repair_mcap(directory_.write("from.mcap", content_.substr(0, data_end)), to_, "mender");
  // But for the record that says who repaired it, the data are byte for byte the same.
  EXPECT_EQ(content_of_file(to_).substr(0, data_end), content_.substr(0, data_end));
}

TEST_F(Repair, SaysNothingOfLossWhereNothingIsLost) {
  EXPECT_TRUE(repair_mcap(sample_, to_, "mender").is_whole);
  EXPECT_EQ(contents_of(to_).lines.back(), "metadata repaired by=mender");
}

TEST_F(Repair, TouchesNoFileThatIsThere) {
  directory_.write("to.mcap", "mine");
  EXPECT_THROW(repair_mcap(sample_, to_, "mender"), McapError);
  EXPECT_THROW(repair_mcap(sample_, sample_, "mender"), McapError);
  EXPECT_EQ(content_of_file(to_), "mine");
  EXPECT_EQ(content_of_file(sample_), content_);
}

TEST_F(Repair, LeavesNothingWhereItIsStopped) {
  const auto stop = [](std::uint64_t done, std::uint64_t) {
    if (done > 200) throw McapError("stopped");
  };
  EXPECT_THROW(repair_mcap(sample_, to_, "mender", recording::kMaxChunkBytes, stop), McapError);
  EXPECT_FALSE(std::filesystem::exists(to_));
}

// Compressed, they would take the file little, and their index the disk and memory much.
TEST_F(Repair, RefusesMoreMessagesInAChunkThanOneMayHave) {
  std::string file(recording::kMagic);
  recording::append_header(file, "", "another");
  recording::append_channel(file, 7, {0, "/a", "raw", {}});
  std::string records;
  constexpr std::size_t kMost = std::size_t{1} << 20;
  for (std::size_t i = 0; i <= kMost; ++i) recording::append_message(records, message(7, 1, ""));
  std::string chunk;
  recording::append<std::uint64_t>(chunk, 1'001);
  recording::append<std::uint64_t>(chunk, 1'001);
  recording::append<std::uint64_t>(chunk, records.size());
  recording::append<std::uint32_t>(chunk, 0);
  recording::append_string(chunk, "");
  recording::append<std::uint64_t>(chunk, records.size());
  const std::size_t chunk_at = file.size();
  recording::append_record(file, recording::Opcode::chunk, chunk + records);
  const std::string from = directory_.write("from.mcap", file);
  try {
    repair_mcap(from, to_, "mender");
    ADD_FAILURE() << "it was repaired";
  } catch (const McapError& error) {
    EXPECT_THAT(error.what(),
                HasSubstr("cannot repair " + from + ": at byte " + std::to_string(chunk_at) +
                          ", a chunk has more than 1048576 messages"));
  }
  EXPECT_FALSE(std::filesystem::exists(to_));
}

TEST_F(Repair, DeletesNoFileOfSomebodyElse) {
  const auto replace = [&](std::uint64_t done, std::uint64_t) {
    if (done < 200) return;
    std::filesystem::remove(to_);
    directory_.write("to.mcap", "mine");
    throw McapError("stopped");
  };
  EXPECT_THROW(repair_mcap(sample_, to_, "mender", recording::kMaxChunkBytes, replace), McapError);
  EXPECT_EQ(content_of_file(to_), "mine");
}

// Another writer's file: messages outside of chunks, no indexes, declarations within chunks.
TEST_F(Repair, CountsWhatStandsOutsideOfChunks) {
  std::string file(recording::kMagic);
  recording::append_header(file, "ros2", "another");
  recording::append_channel(file, 7, {0, "/a", "raw", {}});
  recording::append_message(file, message(7, 1, "one"));
  recording::append_record(file, static_cast<recording::Opcode>(0x81), "of somebody");
  repair_mcap(directory_.write("from.mcap", file), to_, "mender");
  const std::string repaired = content_of_file(to_);
  EXPECT_EQ(repaired.substr(0, file.size()), file);
  const Contents found = contents_of(to_);
  EXPECT_EQ(found.lines.size(), 3U);
  EXPECT_TRUE(found.end.has_summary);
}

}  // namespace
}  // namespace arbiter::test
