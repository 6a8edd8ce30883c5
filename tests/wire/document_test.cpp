// Documents as they come over the socket.
#include "wire/document.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <string>

#include <nlohmann/json.hpp>

#include "shm/segment.hpp"
#include "tests/support/error_of.hpp"
#include "wire/change_report.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;

TEST(Document, IsReadFromMemory) {
  const auto file = shm::make_segment("test-document", 5);
  ASSERT_EQ(::pwrite(file.get(), "{\"a\":", 5, 0), 5);
  EXPECT_EQ(wire::read_document(file), "{\"a\":");
}

// Nobody writes: whoever read it would wait for ever.
TEST(Document, ThatIsAPipeIsNotRead) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const shm::FileDescriptor read(ends[0]);
  const shm::FileDescriptor write(ends[1]);
  EXPECT_EQ(error_of([&] { static_cast<void>(wire::read_document(read)); }),
            "the daemon sent no document");
  EXPECT_EQ(error_of([] { static_cast<void>(wire::read_document(shm::FileDescriptor())); }),
            "the daemon sent no document");
}

TEST(Document, ThatIsTooLargeIsNotRead) {
  const auto file = shm::make_segment("test-document", wire::kMaxDocument + 1);
  EXPECT_THAT(error_of([&] { static_cast<void>(wire::read_document(file)); }),
              HasSubstr("is not read: it may have"));
}

TEST(Document, ThatIsNestedTooDeeplyIsRefused) {
  const auto nested = [](std::size_t depth) {
    return std::string(depth, '[') + std::string(depth, ']');
  };
  EXPECT_TRUE(wire::parse_document(nested(wire::kMaxNesting)).is_array());
  EXPECT_THAT(error_of([&] { static_cast<void>(wire::parse_document(nested(10'000'000))); }),
              HasSubstr("nested more than 16 deep"));
}

TEST(Document, ThatIsNotUtf8IsRefused) {
  EXPECT_THAT(error_of([] { static_cast<void>(wire::parse_document("{\"a\": \"\xff\"}")); }),
              HasSubstr("the daemon's document is not JSON"));
}

TEST(Document, IsWrittenWithWhatIsNotUtf8Replaced) {
  EXPECT_EQ(wire::write_document({{"a", "\xff"}}), "{\n  \"a\": \"\xEF\xBF\xBD\"\n}\n");
}

TEST(ChangeReport, HasTheDifferenceThatTheDaemonSent) {
  const auto report_with = [](const std::string& changes) {
    return wire::read_change_report(
        R"({"ok": true, "has_errors": false, "text": "", "models": [{"name": "work", "in_force":
           true, "changes": {"summary": "", "text": "")" +
        changes + "}}]}");
  };
  EXPECT_FALSE(report_with("").models.value().at(0).changes.value().diff)
      << "a daemon may not tell";
  const auto report =
      report_with(R"(, "diff": {"ports": [{"port": "/in", "after": {"exists": false}}]})");
  const auto& ports = report.models.value().at(0).changes.value().diff.value().ports;
  ASSERT_EQ(ports.size(), 1u);
  EXPECT_EQ(ports[0].port, "/in");
  EXPECT_FALSE(ports[0].after.exists);
  EXPECT_THAT(error_of([&] {
                static_cast<void>(report_with(R"(, "diff": {"ports": [{"port": "/in"}]})"));
              }),
              HasSubstr("after"));
}

}  // namespace
}  // namespace arbiter::test
