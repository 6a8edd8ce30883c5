// docs/glossary.md: each word once, in order, and where it says that it lives. And the files that
// the pages for whoever builds upon the system name, are there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <regex>

#include "tests/support/page_tables.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

std::string in_source(const std::string& path) { return std::string(ARBITER_SOURCE) + "/" + path; }

std::vector<PageRow> words() {
  return rows_of(content_of(in_source("docs/glossary.md")),
                 {"word", "what it is", "paper", "where"});
}

bool is_path(const std::string& text) {
  return std::regex_match(text, std::regex("[a-z]+(/[a-z_]+)+\\.[a-z]+"));
}

// Outside of comments, as a word of its own.
bool has_name(const std::string& source, const std::string& name) {
  const std::string code = std::regex_replace(source, std::regex("//[^\n]*"), "");
  return std::regex_search(code, std::regex("\\b" + name + "\\b"));
}

TEST(Glossary, HasEachWordOnceAndInOrder) {
  std::map<std::string, std::vector<std::string>> sections;
  std::set<std::string> all;
  for (const PageRow& row : words()) {
    ASSERT_EQ(row.cells.size(), 4u) << row.line;
    sections[row.section].push_back(row.cells[0]);
    EXPECT_TRUE(all.insert(row.cells[0]).second) << row.cells[0];
    EXPECT_TRUE(row.cells[1].ends_with('.') || row.cells[1].ends_with(')')) << row.cells[0];
  }
  EXPECT_GE(all.size(), 35u);
  for (auto& [section, words] : sections) {
    auto sorted = words;
    const auto lower = [](const std::string& word) {
      std::string result = word;
      std::transform(result.begin(), result.end(), result.begin(),
                     [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
      return result;
    };
    std::sort(sorted.begin(), sorted.end(),
              [&](const std::string& a, const std::string& b) { return lower(a) < lower(b); });
    EXPECT_EQ(words, sorted) << section;
  }
}

// `file` `name`: the file has that name. Several pairs may follow each other.
TEST(Glossary, SaysWhereTheCodeIs) {
  for (const PageRow& row : words()) {
    std::string source;
    bool has_any = false;
    for (const std::string& each : quoted(row.cells.at(3))) {
      if (is_path(each)) {
        ASSERT_TRUE(std::filesystem::exists(in_source(each))) << row.cells[0] << ": " << each;
        source = content_of(in_source(each));
        continue;
      }
      EXPECT_TRUE(has_name(source, each)) << row.cells[0] << ": no " << each << " in that file";
      has_any = true;
    }
    EXPECT_TRUE(has_any) << row.cells[0];
  }
}

TEST(Glossary, FindsNamesAndNothingElse) {
  EXPECT_TRUE(has_name("struct Lane {", "Lane"));
  EXPECT_FALSE(has_name("struct Lanes {  // a Lane", "Lane"));
  EXPECT_TRUE(is_path("shm/input_segment.hpp"));
  EXPECT_FALSE(is_path("/Arm/pos:i"));
}

TEST(Pages, NameFilesThatAreThere) {
  for (const std::string page : {"glossary.md", "protocol.md", "status.md"}) {
    std::size_t count = 0;
    for (const std::string& each : quoted(content_of(in_source("docs/" + page)))) {
      if (!is_path(each)) continue;
      EXPECT_TRUE(std::filesystem::exists(in_source(each))) << page << ": " << each;
      ++count;
    }
    EXPECT_GT(count, 1u) << page;
  }
}

}  // namespace
}  // namespace arbiter::test
