// Files that end early, are damaged, were made by other writers, or to do harm.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "recording/compression.hpp"
#include "recording/crc32.hpp"
#include "recording/records.hpp"
#include "tests/recording/contents.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

using recording::McapError;
using recording::McapWriter;
using recording::Opcode;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class Reader : public testing::Test {
 protected:
  std::string sample(Compression compression = Compression::zstd) {
    const std::string path = directory_.file("sample.mcap");
    McapWriter writer(path, "test", {compression});
    lines_ = write_one_of_each(writer);
    return content_of_file(path);
  }

  Contents read(std::string_view content, std::size_t max = recording::kMaxChunkBytes) {
    return contents_of(directory_.write("read.mcap", content), max);
  }

  // Magic and header, to which a test appends.
  static std::string beginning() {
    std::string file(recording::kMagic);
    recording::append_header(file, "", "another");
    return file;
  }

  TemporaryDirectory directory_;
  std::vector<std::string> lines_;
};

struct Place {
  std::uint64_t end = 0;  // of the record
  std::size_t lines = 0;  // that the file has up to there
};

// By the file's own lengths, not by what the reader makes of them.
std::vector<Place> places_of(const std::string& file, const std::vector<std::string>& lines) {
  std::vector<Place> places{{recording::kMagic.size(), 0}};
  std::size_t seen = 0;
  std::size_t chunks = 0;
  std::size_t at = recording::kMagic.size();
  bool is_data = true;
  while (at + recording::kMagic.size() < file.size()) {
    recording::ByteReader head(std::string_view(file).substr(at));
    const auto opcode = static_cast<Opcode>(head.number<std::uint8_t>());
    at += recording::kHeadBytes + head.number<std::uint64_t>();
    if (opcode == Opcode::data_end) is_data = false;
    if (is_data && opcode == Opcode::chunk) {
      seen += 3;
      ++chunks;
    } else if (is_data && (opcode == Opcode::schema || opcode == Opcode::channel ||
                           opcode == Opcode::metadata || opcode == Opcode::attachment)) {
      ++seen;
    }
    places.push_back({at, seen});
  }
  EXPECT_EQ(chunks, 2U);
  EXPECT_EQ(seen, lines.size());
  return places;
}

TEST_F(Reader, ReadsOfEachPrefixTheRecordsThatAreWhole) {
  for (const Compression compression : {Compression::none, Compression::lz4, Compression::zstd}) {
    std::filesystem::remove(directory_.file("sample.mcap"));
    const std::string file = sample(compression);
    const auto places = places_of(file, lines_);
    for (std::size_t size = 0; size < file.size(); ++size) {
      Place last;
      for (const Place& place : places) {
        if (place.end <= size) last = place;
      }
      const Contents found = read(std::string_view(file).substr(0, size));
      ASSERT_FALSE(found.end.is_whole) << size;
      ASSERT_EQ(found.end.whole_bytes, last.end) << size << ": " << found.end.problem;
      ASSERT_THAT(found.end.problem, HasSubstr("at byte " + std::to_string(last.end)));
      ASSERT_EQ(found.end.file_bytes, size);
      ASSERT_EQ(found.lines,
                std::vector<std::string>(lines_.begin(),
                                         lines_.begin() + static_cast<std::ptrdiff_t>(last.lines)))
          << size;
    }
  }
}

// A flipped bit is noticed, and nothing that was not written so comes before it is.
TEST_F(Reader, NoticesEachBitThatIsFlipped) {
  for (const Compression compression : {Compression::none, Compression::lz4, Compression::zstd}) {
    std::filesystem::remove(directory_.file("sample.mcap"));
    const std::string file = sample(compression);
    for (std::size_t at = recording::kMagic.size(); at < file.size(); ++at) {
      std::string damaged = file;
      damaged[at] = static_cast<char>(damaged[at] ^ (1 << (at % 8)));
      const Contents found = read(damaged, 1 << 20);
      EXPECT_FALSE(found.end.is_whole) << at;
      EXPECT_THAT(found.end.problem, HasSubstr("at byte "));
      EXPECT_LE(found.end.whole_bytes, file.size());
    }
  }
}

TEST_F(Reader, GivesNoMessageOfADamagedChunk) {
  std::string file = sample(Compression::none);
  const std::size_t at = file.find(std::string(200, 'a'));
  file[at + 100] = 'b';
  const Contents found = read(file);
  EXPECT_THAT(found.end.problem, HasSubstr("the chunk: its records do not have the CRC"));
  EXPECT_EQ(found.lines.size(), 4U) << "what stands before the chunk";
}

TEST_F(Reader, RefusesWhatIsNoMcapFile) {
  EXPECT_THROW(read("#!/bin/sh\n"), McapError);
  EXPECT_THROW(read("\x89MCAP1\r\n"), McapError);
  EXPECT_THROW(contents_of(directory_.file("missing")), McapError);
  EXPECT_THROW(contents_of(directory_.path()), McapError);
  EXPECT_THROW(contents_of("/dev/null"), McapError);
}

TEST_F(Reader, ReadsMessagesOutsideOfChunks) {
  std::string file = beginning();
  recording::append_schema(file, 0, {"nobody's", "", ""});
  recording::append_channel(file, 7, {0, "/a", "raw", {}});
  recording::append_message(file, message(7, 1, "one"));
  recording::append_record(file, static_cast<Opcode>(0x7F), "of a later version");
  recording::append_record(file, static_cast<Opcode>(0x81), "of somebody");
  recording::append_message(file, message(7, 2, "two"));
  recording::append_record(file, Opcode::data_end, std::string(4, '\0'));
  recording::append_record(file, Opcode::footer, std::string(20, '\0'));
  file += recording::kMagic;
  const Contents found = read(file);
  EXPECT_THAT(found.lines, ElementsAre("channel 7 0 /a raw", "message 7 1 1001 901 one",
                                       "message 7 2 1002 902 two"));
  EXPECT_TRUE(found.end.is_whole) << found.end.problem;
  EXPECT_FALSE(found.end.has_summary);
  EXPECT_THAT(read(file + "more").end.problem, HasSubstr("4 bytes behind"));
}

std::string chunk(std::string_view compression, std::string_view records, std::uint64_t size,
                  std::uint32_t crc = 0) {
  std::string content(16, '\0');
  recording::append(content, size);
  recording::append(content, crc);
  recording::append_string(content, compression);
  recording::append<std::uint64_t>(content, records.size());
  content += records;
  std::string record;
  recording::append_record(record, Opcode::chunk, content);
  return record;
}

TEST_F(Reader, NeverTakesMoreMemoryThanItMay) {
  const std::string zeros(1 << 20, '\0');
  for (const Compression compression : {Compression::lz4, Compression::zstd}) {
    const std::string packed = recording::Compressor(compression).compress(zeros);
    ASSERT_LT(packed.size(), 10'000U);
    const auto name = recording::name_of(compression);
    EXPECT_THAT(read(beginning() + chunk(name, packed, zeros.size()), 1 << 19).end.problem,
                HasSubstr("when decompressed, more than the 524288"));
    // It says less than it has, and more.
    EXPECT_THAT(read(beginning() + chunk(name, packed, 1'000)).end.problem, HasSubstr("the chunk"));
    EXPECT_THAT(read(beginning() + chunk(name, packed, zeros.size() + 1)).end.problem,
                HasSubstr("less than the chunk says"));
    EXPECT_THAT(read(beginning() + chunk(name, packed.substr(0, 20), zeros.size())).end.problem,
                HasSubstr("the chunk"));
  }
  EXPECT_THAT(read(beginning() + chunk("", "", ~std::uint64_t{0})).end.problem,
              HasSubstr("more than"));
  EXPECT_THAT(read(beginning() + chunk("bz2", "", 0)).end.problem, HasSubstr("compressions"));
}

TEST_F(Reader, BoundsWhatAFileDeclares) {
  std::string file = beginning();
  for (std::uint16_t id = 1; id <= 3; ++id) {
    recording::append_schema(file, id, {"", "", std::string(400, 's')});
  }
  const Contents found = read(file, 1'000);
  EXPECT_EQ(found.lines.size(), 2U);
  EXPECT_THAT(found.end.problem, HasSubstr("the schemas and channels take more than 1000 bytes"));
  std::string map;
  for (int i = 0; i < 2 * 70'000; ++i) recording::append_string(map, std::to_string(i));
  std::string content(4, '\0');
  recording::append_string(content, map);
  file = beginning();
  recording::append_record(file, Opcode::metadata, content);
  EXPECT_THAT(read(file).end.problem, HasSubstr("more than 65536 entries"));
  // Maps take far more memory than their bytes.
  file = beginning();
  for (std::uint16_t id = 1; id <= 50; ++id) {
    recording::McapChannel channel;
    for (int i = 0; i < 20'000; ++i) channel.metadata[std::to_string(i)] = "";
    recording::append_channel(file, id, channel);
  }
  EXPECT_THAT(read(file).end.problem, HasSubstr("take more than 67108864 bytes"));
}

TEST_F(Reader, WantsEachReferenceToBeKnown) {
  std::string records;
  recording::append_channel(records, 1, {0, "/a", "raw", {}});
  recording::append_message(records, message(1, 1, "one"));
  recording::append_message(records, message(2, 2, "two"));
  const Contents found = read(beginning() + chunk("", records, records.size()));
  EXPECT_THAT(found.lines, IsEmpty());
  EXPECT_THAT(found.end.problem, HasSubstr("no channel 2"));
  std::string file = beginning();
  recording::append_channel(file, 1, {5, "/a", "raw", {}});
  EXPECT_THAT(read(file).end.problem, HasSubstr("no schema 5"));
  file = beginning();
  recording::append_channel(file, 1, {0, "/a", "raw", {}});
  recording::append_channel(file, 1, {0, "/a", "raw", {}});
  recording::append_channel(file, 1, {0, "/b", "raw", {}});
  const Contents twice = read(file);
  EXPECT_EQ(twice.lines.size(), 2U);
  EXPECT_THAT(twice.end.problem, HasSubstr("differs from an earlier channel"));
}

TEST_F(Reader, LetsEachRecordStandOnlyWhereItMay) {
  std::string inner;
  recording::append_attachment(inner, {"a", "b", 1, "c"});
  EXPECT_THAT(read(beginning() + chunk("", inner, inner.size())).end.problem,
              HasSubstr("it contains a attachment"));
  std::string file(recording::kMagic);
  recording::append_metadata(file, "early", {});
  EXPECT_THAT(read(file).end.problem, HasSubstr("begins with a header"));
  file = beginning();
  recording::append_header(file, "", "");
  EXPECT_THAT(read(file).end.problem, HasSubstr("only one"));
  file = beginning();
  recording::append_record(file, Opcode::statistics, "");
  EXPECT_THAT(read(file).end.problem, HasSubstr("before the end of the data"));
}

}  // namespace
}  // namespace arbiter::test
