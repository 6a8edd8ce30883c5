#include "rules/text/text_file.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <string>
#include <utility>
#include <vector>

#include "rules/model/load.hpp"
#include "shm/utf8.hpp"
#include "tests/rules/model_text.hpp"

namespace arbiter::rules {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TEST(TextFile, KnowsLineAndColumnOfEachByte) {
  const TextFile file("f", "ab\n\ncd\r\ne");
  const std::vector<std::pair<std::uint32_t, std::uint32_t>> places{
      {1, 1}, {1, 2}, {1, 3}, {2, 1}, {3, 1}, {3, 2}, {3, 3}, {3, 4}, {4, 1}, {4, 2}};
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_EQ(file.locate(i), (Location{"f", places[i].first, places[i].second})) << i;
  }
  EXPECT_EQ(file.locate(1000), (Location{"f", 4, 2}));
}

TEST(TextFile, CountsColumnsInBytes) {
  EXPECT_EQ(TextFile("f", "äx").locate(2), (Location{"f", 1, 3}));
}

TEST(TextFile, TakesAByteOrderMarkOff) {
  const TextFile file("f", "\xef\xbb\xbf<a/>");
  EXPECT_EQ(file.content(), "<a/>");
  EXPECT_EQ(file.locate(0), (Location{"f", 1, 1}));
}

std::string why_unreadable(const std::string& path) {
  try {
    read_bytes(path);
  } catch (const FileError& error) {
    return error.what();
  }
  return "";
}

TEST(TextFile, ThatCannotBeReadIsNamedWithTheReason) {
  const Folder folder;
  EXPECT_THAT(why_unreadable(folder.file("none.xml")),
              AllOf(HasSubstr("none.xml"), HasSubstr("No such file or directory")));
  EXPECT_THAT(why_unreadable(folder.file("")), HasSubstr("Is a directory"));
  EXPECT_EQ(why_unreadable("/dev/null"), "");
}

std::string why_not_regular(const std::string& path) {
  try {
    read_bytes(path, kMaxFileBytes, Accept::kRegularFile);
  } catch (const FileError& error) {
    return error.what();
  }
  return "";
}

// Nobody writes to the FIFO: to open it would wait for ever.
TEST(TextFile, ThatIsNotRegularIsRefusedWithoutOpeningIt) {
  const Folder folder;
  const std::string fifo = folder.file("fifo");
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  EXPECT_EQ(why_not_regular(fifo), "cannot read " + fifo + ": it is not a regular file but a FIFO");
  EXPECT_THAT(why_not_regular("/dev/null"), HasSubstr("not a regular file but a device"));
  EXPECT_THAT(why_not_regular(folder.file("")), HasSubstr("Is a directory"));
  EXPECT_THAT(why_not_regular(folder.file("none.xml")), HasSubstr("No such file or directory"));
  EXPECT_EQ(why_not_regular("/proc/self/status"), "");
}

TEST(TextFile, MayBeAPipeButNoFifo) {
  const Folder folder;
  const std::string fifo = folder.file("fifo");
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  EXPECT_EQ(why_unreadable(fifo), "cannot read " + fifo + ": it is not a regular file but a FIFO");
  int ends[2];
  ASSERT_EQ(::pipe2(ends, O_CLOEXEC), 0);
  ASSERT_EQ(::write(ends[1], "<a/>", 4), 4);
  ::close(ends[1]);
  EXPECT_EQ(read_bytes("/proc/self/fd/" + std::to_string(ends[0])), "<a/>");
  ::close(ends[0]);
}

TEST(TextFile, WithoutAnEndIsReadUpToTheLimit) {
  EXPECT_GT(read_bytes("/dev/zero").size(), kMaxFileBytes);
  EXPECT_LT(read_bytes("/dev/zero").size(), 2 * kMaxFileBytes);
}

TEST(Utf8, IsDecodedStrictly) {
  const std::vector<std::pair<std::string, std::uint32_t>> good{
      {"a", 'a'}, {"ä", 0xe4}, {"→", 0x2192}, {"😀", 0x1f600}, {"\xf4\x8f\xbf\xbf", 0x10ffff}};
  for (const auto& [bytes, code] : good) {
    EXPECT_EQ(shm::decode_utf8(bytes + "x").code, code);
    EXPECT_EQ(shm::decode_utf8(bytes).length, bytes.size());
    EXPECT_EQ(shm::encode_utf8(code), bytes);
  }
  for (const std::string bad :
       {"\x80", "\xc3", "\xc3x", "\xc0\x80", "\xc1\xbf", "\xe0\x80\x80", "\xed\xa0\x80", "\xe2\x86",
        "\xf4\x90\x80\x80", "\xf8\x88\x80\x80\x80", "\xff", ""}) {
    EXPECT_EQ(shm::decode_utf8(bad).length, 0u);
  }
}

}  // namespace
}  // namespace arbiter::rules
