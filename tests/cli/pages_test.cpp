// Runs the listings of pages. In a page,
//
//   ```xml FILE, ```csv FILE and ```text FILE
//                make that file (of a README in examples/models: the folder's own files are there
//                already);
//   ```console   holds commands behind "$ ", and below each what it prints, both streams, to the
//                letter; one that prints nothing must succeed. $? is that of the command before.
//
// Any other listing has nothing to be run, and must be marked as ```text, without a file.
//
// ARBITER_UPDATE_PAGES=1 writes what is printed into the pages instead; read the difference.
#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include <arbiter/arbiter.hpp>

#include "tests/support/daemon.hpp"
#include "tests/support/run_program.hpp"
#include "tests/support/temporary_directory.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

namespace fs = std::filesystem;

struct Listing {
  int line;
  std::string kind;
  std::string file;
  std::string content;
};

std::vector<Listing> listings_of(const std::string& page) {
  std::vector<Listing> listings;
  std::istringstream text(content_of(page));
  bool inside = false;
  int number = 0;
  for (std::string line; std::getline(text, line);) {
    ++number;
    if (!line.starts_with("```")) {
      if (inside) listings.back().content += line + "\n";
      continue;
    }
    inside = !inside;
    if (!inside) continue;
    std::istringstream info(line.substr(3));
    Listing listing{number, {}, {}, {}};
    info >> listing.kind >> listing.file;
    listings.push_back(listing);
  }
  EXPECT_FALSE(inside) << page << " ends within a listing";
  return listings;
}

struct Command {
  std::string text, output;
};

std::vector<Command> commands_of(const std::string& content) {
  std::vector<Command> commands;
  std::istringstream text(content);
  for (std::string line; std::getline(text, line);) {
    if (line.starts_with("$ ")) {
      commands.push_back({line.substr(2), {}});
    } else if (!commands.empty() && commands.back().text.ends_with("\\")) {
      commands.back().text += "\n" + line;
    } else if (!commands.empty()) {
      commands.back().output += line + "\n";
    } else {
      ADD_FAILURE() << "a line before the first command: " << line;
    }
  }
  return commands;
}

// Lines of a page and what belongs there.
struct Correction {
  int first = 0, count = 0;
  std::string text;
};

// How many listings were run, by kind.
using Counts = std::map<std::string, int>;

class PageRun {
 public:
  PageRun(std::string page, std::string folder)
      : page_(std::move(page)), folder_(std::move(folder)) {}

  Counts run() {
    Counts counts;
    for (const Listing& listing : listings_of(page_)) {
      SCOPED_TRACE(page_ + ":" + std::to_string(listing.line));
      ++counts[listing.kind];
      const bool is_prose = listing.kind == "text" && listing.file.empty();
      if (is_prose) continue;
      if (listing.kind == "xml" || listing.kind == "csv" || listing.kind == "text") {
        EXPECT_FALSE(listing.file.empty()) << "a listing that no command can use: name its file";
        std::ofstream(fs::path(folder_) / listing.file) << listing.content;
      } else if (listing.kind == "console") {
        run_commands(listing);
      } else {
        ADD_FAILURE() << "nobody runs this: " << listing.kind;
      }
    }
    if (updates()) correct();
    return counts;
  }

 private:
  // With ARBITER_UPDATE_PAGES=1 the pages are corrected instead, to be looked at by somebody.
  static bool updates() { return std::getenv("ARBITER_UPDATE_PAGES") != nullptr; }

  void run_commands(const Listing& listing) {
    Correction correction{listing.line, 0, {}};
    correction.count =
        static_cast<int>(std::count(listing.content.begin(), listing.content.end(), '\n'));
    for (const Command& command : commands_of(listing.content)) {
      const auto result =
          run_program({"/bin/sh", "-c",
                       "PATH=" ARBITER_PROGRAMS ":$PATH; cd '" + folder_ + "' && { (exit " +
                           std::to_string(exit_code_) + "); " + command.text + "\n} 2>&1"});
      exit_code_ = result.exit_code;
      correction.text += "$ " + command.text + "\n" + result.out;
      if (updates()) continue;
      EXPECT_EQ(result.out, command.output)
          << "$ " << command.text
          << "\nIf what it prints now is right, ARBITER_UPDATE_PAGES=1 lets this test write it "
             "into "
             "the page.";
      if (command.output.empty()) {
        EXPECT_EQ(result.exit_code, 0) << "$ " << command.text;
      }
    }
    corrections_.push_back(std::move(correction));
  }

  void correct() const {
    std::istringstream text(content_of(page_));
    std::ostringstream corrected;
    auto next = corrections_.begin();
    int number = 0;
    for (std::string line; std::getline(text, line);) {
      ++number;
      if (next != corrections_.end() && number == next->first + 1) {
        corrected << next->text;
        for (int i = 1; i < next->count; ++i, ++number) std::getline(text, line);
        ++next;
      } else {
        corrected << line << '\n';
      }
    }
    std::ofstream(page_) << corrected.str();
  }

  std::string page_, folder_;
  int exit_code_ = 0;                    // of the command before
  std::vector<Correction> corrections_;  // of each listing of commands, in order
};

Counts run_listings(const std::string& page, const std::string& folder) {
  return PageRun(page, folder).run();
}

TEST(Pages, TheTutorialOfModelsRuns) {
  const TemporaryDirectory directory;
  fs::create_directory_symlink(ARBITER_SOURCE "/examples", directory.path() + "/examples");
  Counts counts = run_listings(ARBITER_SOURCE "/docs/models.md", directory.path());
  EXPECT_GE(counts["xml"], 6);
  EXPECT_GE(counts["csv"], 3);
  EXPECT_GE(counts["console"], 12);
}

TEST(Pages, OnCheckingRun) {
  const TemporaryDirectory directory;
  Counts counts = run_listings(ARBITER_SOURCE "/docs/checking.md", directory.path());
  EXPECT_GE(counts["xml"], 7);
  EXPECT_GE(counts["console"], 9);
}

TEST(Pages, OnImportingRun) {
  const TemporaryDirectory directory;
  Counts counts = run_listings(ARBITER_SOURCE "/docs/importing.md", directory.path());
  EXPECT_GE(counts["text"], 5);
  EXPECT_GE(counts["console"], 7);
}

TEST(Pages, OfTheLibraryOfModelsRun) {
  int pages = 0;
  for (const auto& entry : fs::directory_iterator(ARBITER_SOURCE "/examples/models")) {
    if (!entry.is_directory()) continue;
    // A copy: a listing must not write into the source tree.
    const TemporaryDirectory directory;
    fs::copy(entry.path(), directory.path(), fs::copy_options::recursive);
    Counts counts = run_listings(entry.path().string() + "/README.md", directory.path());
    EXPECT_GE(counts["console"], 1) << entry.path() << " shows nothing to try";
    ++pages;
  }
  EXPECT_GE(pages, 8);
}

// Beside a daemon with the first model on the page.
TEST(Pages, OnWatchingARunningInstanceRun) {
  const std::string page = ARBITER_SOURCE "/docs/watching.md";
  const Listing model = listings_of(page).at(0);
  ASSERT_EQ(model.file, "base.xml");
  const Daemon daemon(model.content);
  const TemporaryDirectory directory;
  Counts counts = run_listings(page, directory.path());
  EXPECT_GE(counts["console"], 1);
}

// The same, and with a motor that takes what is delivered.
TEST(Pages, OnAnIncidentRun) {
  const std::string page = ARBITER_SOURCE "/docs/incident.md";
  const Listing model = listings_of(page).at(0);
  ASSERT_EQ(model.file, "base.xml");
  const TemporaryDirectory directory;
  const std::string file = directory.write("base.xml", model.content);
  Daemon::Options options;
  options.without_model = true;
  options.arguments = {"--model", file};
  const Daemon daemon("", options);
  Node node("motor");
  const auto motor = node.input_port("/Base/cmd:i");
  Counts counts = run_listings(page, directory.path());
  EXPECT_GE(counts["console"], 6);
}

// What the tests above rest upon.
TEST(Pages, WhoseListingsSaySomethingElseAreFound) {
  if (std::getenv("ARBITER_UPDATE_PAGES") != nullptr) GTEST_SKIP() << "pages are corrected";
  const TemporaryDirectory directory;
  const auto failures_of = [&](const std::string& text) {
    const auto page = directory.write("page.md", text);
    testing::TestPartResultArray found;
    {
      const testing::ScopedFakeTestPartResultReporter reporter(
          testing::ScopedFakeTestPartResultReporter::INTERCEPT_ALL_THREADS, &found);
      run_listings(page, directory.path());
    }
    return found.size();
  };
  EXPECT_EQ(failures_of("```console\n$ echo a; echo b >&2\na\nb\n$ true\n```\n"), 0);
  EXPECT_EQ(failures_of("```text t\na\n```\n```console\n$ cat t; false\na\n$ echo $?\n1\n```\n"),
            0);
  EXPECT_EQ(failures_of("```csv t.csv\na\n```\n```console\n$ cat t.csv\na\n```\n"), 0);
  EXPECT_EQ(failures_of("```console\n$ echo a\nb\n```\n"), 1);
  EXPECT_EQ(failures_of("```console\n$ echo a\n```\n"), 1);
  EXPECT_EQ(failures_of("```console\n$ false\n```\n"), 1);
  EXPECT_EQ(failures_of("```sh\nrm -rf /\n```\n"), 1);
  EXPECT_GE(failures_of("```xml\n<a/>\n```\n"), 1);
  EXPECT_EQ(failures_of("```text\n"), 1);
}

}  // namespace
}  // namespace arbiter::test
