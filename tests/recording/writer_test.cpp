// What is written is read again, whatever compresses it, and however the writer ends.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include "recording/crc32.hpp"
#include "recording/mcap_chunk.hpp"
#include "tests/recording/contents.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

using recording::McapError;
using recording::McapWriter;
using testing::ElementsAreArray;
using testing::HasSubstr;

class EachCompression : public testing::TestWithParam<Compression> {
 protected:
  TemporaryDirectory directory_;
};

TEST_P(EachCompression, ReadsWhatWasWritten) {
  const std::string path = directory_.file("a.mcap");
  McapWriter writer(path, "test", {GetParam()});
  const auto lines = write_one_of_each(writer);
  const Contents found = contents_of(path);
  EXPECT_THAT(found.lines, ElementsAreArray(lines));
  EXPECT_TRUE(found.end.is_whole) << found.end.problem;
  EXPECT_TRUE(found.end.has_summary);
  EXPECT_EQ(found.end.whole_bytes, std::filesystem::file_size(path));
  ASSERT_EQ(found.chunks.size(), 2U);
  const bool is_smaller = found.chunks[1].compressed < found.chunks[1].uncompressed;
  EXPECT_EQ(is_smaller, GetParam() != Compression::none);
}

INSTANTIATE_TEST_SUITE_P(Mcap, EachCompression,
                         testing::Values(Compression::none, Compression::lz4, Compression::zstd),
                         name_of);

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const McapError& error) {
    return error.what();
  }
  return "";
}

class Writer : public testing::Test {
 protected:
  TemporaryDirectory directory_;
  std::string path_ = directory_.file("a.mcap");
};

TEST_F(Writer, MakesAFileForItsUserAlone) {
  const McapWriter writer(path_, "test", {});
  const auto mode = std::filesystem::status(path_).permissions();
  EXPECT_EQ(mode & (std::filesystem::perms::group_all | std::filesystem::perms::others_all),
            std::filesystem::perms::none);
}

TEST_F(Writer, TouchesNoFileThatIsThere) {
  directory_.write("a.mcap", "mine");
  EXPECT_THROW(McapWriter(path_, "test", {}), McapError);
  EXPECT_EQ(content_of_file(path_), "mine");
}

TEST_F(Writer, LeavesTheClosedChunksIfItNeverEnds) {
  {
    McapWriter writer(path_, "test", {});
    const auto channel = writer.add_channel({0, "/a", "raw", {}});
    writer.write(message(channel, 1, "closed"));
    writer.end_chunk();
    writer.sync();
    writer.write(message(channel, 2, "open"));
  }
  const Contents found = contents_of(path_);
  EXPECT_THAT(found.lines, ElementsAreArray({"channel 1 0 /a raw", "message 1 1 1001 901 closed"}));
  EXPECT_FALSE(found.end.is_whole);
  EXPECT_THAT(found.end.problem, HasSubstr("no footer"));
}

TEST_F(Writer, ClosesAChunkThatHasItsSize) {
  McapWriter writer(path_, "test", {Compression::none, 100});
  const auto channel = writer.add_channel({0, "/a", "raw", {}});
  for (std::uint32_t i = 0; i < 10; ++i) writer.write(message(channel, i, "twenty bytes of data"));
  writer.close();
  const Contents found = contents_of(path_);
  EXPECT_EQ(found.chunks.size(), 5U);
  EXPECT_EQ(found.lines.size(), 11U);
}

TEST_F(Writer, SaysWhatItHasNot) {
  McapWriter writer(path_, "test", {});
  EXPECT_THROW(writer.write(message(1, 1, "")), McapError);
  EXPECT_THROW(writer.add_channel({1, "/a", "raw", {}}), McapError);
  writer.close();
  EXPECT_THROW(writer.close(), McapError);
  EXPECT_TRUE(contents_of(path_).end.is_whole);
}

// Or it would be a file that our own reader takes for damaged.
TEST_F(Writer, RefusesWhatNobodyWouldReadAndGoesOn) {
  McapWriter writer(path_, "test", {});
  const auto channel = writer.add_channel({0, "/a", "raw", {}});
  const std::unique_ptr<std::byte[]> large(new std::byte[recording::kMaxChunkBytes]);
  EXPECT_THAT(message_of([&] {
                writer.write({channel, 1, 1, 1, {large.get(), recording::kMaxChunkBytes}});
              }),
              HasSubstr("268435456 bytes are more than"));
  const recording::McapSchema schema{"s", "x", std::string(recording::kMaxDeclaredBytes, 'x')};
  EXPECT_THAT(message_of([&] { writer.add_schema(schema); }), HasSubstr("than the 67108864"));
  writer.write(message(channel, 2, "small"));
  writer.close();
  EXPECT_EQ(contents_of(path_).lines.back(), "message 1 2 1002 902 small");
}

// Chunks of a flight recorder: closed long before the file exists, the oldest dropped.
TEST_F(Writer, AppendsChunksThatWereKept) {
  recording::McapChunkBuilder builder(Compression::lz4);
  std::vector<recording::McapChunk> kept;
  for (std::uint32_t i = 0; i < 3; ++i) {
    builder.write(message(1, 2 * i, std::string(100, 'x')));
    builder.write(message(2, 2 * i + 1, "y"));
    kept.push_back(builder.close());
    EXPECT_TRUE(builder.is_empty());
  }
  McapWriter writer(path_, "test", {});
  writer.add_channel({0, "/a", "raw", {}});
  EXPECT_THROW(writer.append(kept[1]), McapError) << "channel 2 is not added yet";
  writer.add_channel({0, "/b", "raw", {}});
  writer.append(kept[1]);
  writer.write(message(2, 9, "between"));
  writer.append(kept[2]);
  writer.close();
  const Contents found = contents_of(path_);
  const std::string x(100, 'x');
  EXPECT_THAT(
      found.lines,
      ElementsAreArray({std::string("channel 1 0 /a raw"), std::string("channel 2 0 /b raw"),
                        "message 1 2 1002 902 " + x, std::string("message 2 3 1003 903 y"),
                        std::string("message 2 9 1009 909 between"), "message 1 4 1004 904 " + x,
                        std::string("message 2 5 1005 905 y")}));
  EXPECT_TRUE(found.end.is_whole) << found.end.problem;
}

// What the system refuses behind so many bytes, as a full disk would.
class SizeLimit {
 public:
  explicit SizeLimit(rlim_t bytes) : before_(::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &limit_);
    const rlimit lower{bytes, limit_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &lower);
  }
  ~SizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &limit_);
    ::signal(SIGXFSZ, before_);
  }
  SizeLimit(const SizeLimit&) = delete;
  SizeLimit& operator=(const SizeLimit&) = delete;

 private:
  void (*before_)(int);
  rlimit limit_{};
};

TEST_F(Writer, EndsAfterTheLastChunkForWhichThereIsRoom) {
  std::string problem;
  std::string later;
  std::uint32_t written = 0;
  {
    const SizeLimit limit(20'000);
    McapWriter writer(path_, "test", {Compression::none, 3'000});
    const auto channel = writer.add_channel({0, "/a", "raw", {}});
    const std::string data(1'000, 'd');
    problem = message_of([&] {
      for (; written < 1'000; ++written) writer.write(message(channel, written, data));
    });
    later = message_of([&] { writer.write_metadata("m", {}); });
    EXPECT_THAT(message_of([&] { writer.close(); }), HasSubstr("File too large"));
  }
  EXPECT_THAT(problem, testing::AllOf(HasSubstr(path_), HasSubstr("File too large"),
                                      HasSubstr("whole record"), HasSubstr("ulimit")));
  EXPECT_THAT(later, HasSubstr("File too large"));
  const Contents found = contents_of(path_);
  EXPECT_THAT(found.end.problem, HasSubstr("no footer"));
  EXPECT_EQ(found.end.whole_bytes, std::filesystem::file_size(path_));
  EXPECT_EQ(found.chunks.size(), 6U);
  EXPECT_EQ(found.lines.size(), 1 + 6 * 3U);
}

TEST_F(Writer, LeavesNoFileIfThereIsNoRoomForAnything) {
  const SizeLimit limit(10);
  EXPECT_THAT(message_of([&] { const McapWriter writer(path_, "test", {}); }),
              HasSubstr("it was deleted"));
  EXPECT_FALSE(std::filesystem::exists(path_));
}

// The kernel writes on into a file that has no name any more.
TEST_F(Writer, SaysThatItsFileWasDeleted) {
  McapWriter writer(path_, "test", {});
  writer.sync();
  std::filesystem::remove(path_);
  EXPECT_THAT(message_of([&] { writer.sync(); }),
              testing::AllOf(HasSubstr(path_), HasSubstr("deleted it meanwhile")));
  EXPECT_THAT(message_of([&] { writer.close(); }), HasSubstr("deleted it meanwhile"));
}

// Behind the cut there would be zeros.
TEST_F(Writer, SaysThatItsFileWasCut) {
  McapWriter writer(path_, "test", {});
  const auto channel = writer.add_channel({0, "/a", "raw", {}});
  writer.write(message(channel, 1, "lost"));
  writer.end_chunk();
  std::filesystem::resize_file(path_, 0);
  writer.write(message(channel, 2, "behind it"));
  EXPECT_THAT(message_of([&] { writer.close(); }), HasSubstr("somebody else has written to it"));
}

TEST_F(Writer, DoesNotMindThatItsFileIsRenamed) {
  McapWriter writer(path_, "test", {});
  std::filesystem::rename(path_, path_ + ".moved");
  writer.close();
  EXPECT_TRUE(contents_of(path_ + ".moved").end.is_whole);
}

TEST(Crc32, IsTheOneOfZlib) {
  EXPECT_EQ(recording::crc32(""), 0U);
  EXPECT_EQ(recording::crc32("123456789"), 0xCBF43926U);
  const std::string text = "The quick brown fox jumps over the lazy dog";
  EXPECT_EQ(recording::crc32(text), 0x414FA339U);
  for (std::size_t cut = 0; cut <= text.size(); ++cut) {
    EXPECT_EQ(recording::crc32(text.substr(cut), recording::crc32(text.substr(0, cut))),
              0x414FA339U);
  }
  EXPECT_EQ(recording::crc32({}, 0x414FA339U), 0x414FA339U);
}

}  // namespace
}  // namespace arbiter::test
