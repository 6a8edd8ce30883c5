// Files without an end, or larger than any that is meant: an error that names the limit.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <functional>
#include <string>
#include <thread>

#include "rules/explain/trace.hpp"
#include "rules/model/load.hpp"
#include "tests/rules/model_text.hpp"

namespace arbiter::rules {
namespace {

using testing::HasSubstr;

std::string message_of(const std::function<void(Diagnostics&)>& read) {
  Diagnostics diagnostics;
  read(diagnostics);
  return diagnostics.items().empty() ? "" : diagnostics.items().front().message;
}
std::string read_as_model(const std::string& path) {
  return message_of([&](Diagnostics& diagnostics) { load({{path}, {}}, diagnostics); });
}
std::string read_as_application(const std::string& path) {
  return message_of([&](Diagnostics& diagnostics) { load({{}, path}, diagnostics); });
}
std::string read_as_trace(const std::string& path) {
  return message_of([&](Diagnostics& diagnostics) { read_trace(path, diagnostics); });
}

void expect_too_large(const std::function<std::string()>& make_path) {
  EXPECT_THAT(read_as_model(make_path()), HasSubstr("larger than the limit of 16 MiB"));
  EXPECT_THAT(read_as_application(make_path()), HasSubstr("larger than the limit of 16 MiB"));
  EXPECT_THAT(read_as_trace(make_path()), HasSubstr("larger than the limit of 64 MiB"));
}

TEST(Limits, AFileOf100MegabytesIsTooLarge) {
  const Folder folder;
  const std::string path = folder.write("large", "<behaviors>");
  ASSERT_EQ(::truncate(path.c_str(), 100'000'000), 0);
  expect_too_large([&] { return path; });
}

TEST(Limits, ADeviceWithoutAnEndIsTooLarge) {
  expect_too_large([] { return "/dev/zero"; });
}

TEST(Limits, APipeThatNeverEndsIsTooLarge) {
  const auto old_handler = std::signal(SIGPIPE, SIG_IGN);
  std::thread writer;
  int ends[2] = {-1, -1};
  const auto end = [&] {
    if (!writer.joinable()) return;
    ::close(ends[0]);
    writer.join();
  };
  expect_too_large([&] {
    end();
    if (::pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("pipe2");
    writer = std::thread([pipe = ends[1]] {
      std::string text(4096, ' ');
      text.back() = '\n';
      while (::write(pipe, text.data(), text.size()) > 0) {
      }
      ::close(pipe);
    });
    return "/proc/self/fd/" + std::to_string(ends[0]);
  });
  end();
  std::signal(SIGPIPE, old_handler);
}

TEST(Limits, ADirectoryIsNoFile) {
  const Folder folder;
  EXPECT_THROW(read_as_model(folder.file("")), FileError);
  EXPECT_THROW(read_as_application(folder.file("")), FileError);
  EXPECT_THROW(read_as_trace(folder.file("")), FileError);
}

TEST(Limits, ATraceHasNotMoreEventsThanFitIntoMemory) {
  static_assert(kMaxTraceEvents == 4'194'304);  // docs/semantics.md
  static_assert(kMaxTraceEvents * sizeof(TraceEvent) <= 256u << 20);
  constexpr std::size_t kLimit = 1000;
  std::string text = "t_ns,source\n";
  for (std::size_t i = 0; i < kLimit; ++i) text += "0,\n";
  Diagnostics diagnostics;
  EXPECT_EQ(parse_trace(TextFile("t.csv", text), diagnostics, kLimit).size(), kLimit);
  EXPECT_FALSE(diagnostics.has_errors());
  parse_trace(TextFile("t.csv", text + "0,\n"), diagnostics, kLimit);
  ASSERT_EQ(diagnostics.items().size(), 1u);
  EXPECT_THAT(diagnostics.items()[0].message, HasSubstr("more events than the limit of 1000"));
}

// Ten uses of a define of ten uses of a define …
TEST(Limits, DefinesThatGrowTenfoldEachAreStopped) {
  std::string model = "<behaviors><define name='a0'>lol</define>";
  for (int i = 1; i < 30; ++i) {
    model += "<define name='a" + std::to_string(i) + "'>";
    for (int j = 0; j < 10; ++j) model += "${a" + std::to_string(i - 1) + "}";
    model += "</define>";
  }
  const Loaded loaded = load_text(model + "<source port='/${a29}'/></behaviors>");
  EXPECT_TRUE(loaded.has_errors);
  EXPECT_THAT(loaded.message(), HasSubstr("more than the limit of 64 KiB"));
}

std::string nested_metas(int metas) {
  std::string model = "<behaviors>";
  for (int i = 0; i < metas; ++i) {
    model += "<meta_behavior name='M" + std::to_string(i) + "'><behavior>M" +
             std::to_string(i + 1) + "</behavior><condition>/c</condition></meta_behavior>";
  }
  return model + "<behavior name='M" + std::to_string(metas) +
         "'><config at='/p'>/s</config></behavior></behaviors>";
}

TEST(Limits, AThousandNestedMetaBehavioursAreReadAndMoreAreAnError) {
  EXPECT_FALSE(load_text(nested_metas(1000)).has_errors);
  const Loaded deeper = load_text(nested_metas(1001));
  EXPECT_TRUE(deeper.has_errors);
  EXPECT_THAT(deeper.message(), HasSubstr("than the limit of 1000"));
  EXPECT_TRUE(load_text(nested_metas(50'000)).has_errors);
}

TEST(Limits, AFindingIsOneLineWhateverItCites) {
  const Loaded loaded =
      load_text("<behaviors><source port='${a\nx.xml:1:1: error: not so}'/></behaviors>");
  EXPECT_THAT(loaded.message(), testing::Not(HasSubstr("\n")));
  Diagnostics diagnostics;
  parse_trace(TextFile("t.csv", "t_ns,source\n\"\x1b[2J\n\",/a\n"), diagnostics);
  EXPECT_THAT(diagnostics.items().at(0).message, HasSubstr("the time \"\\x1b[2J\\n\" is not"));
}

}  // namespace
}  // namespace arbiter::rules
