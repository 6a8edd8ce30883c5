// Files that are broken, or made to break their reader: there is always an answer, and soon.
#include <gmock/gmock.h>

#include <random>
#include <string>

#include "rules/model/load.hpp"
#include "tests/rules/model_text.hpp"

namespace arbiter::rules {
namespace {

using testing::HasSubstr;

void expect_places(const Loaded& loaded) {
  for (const Diagnostic& item : loaded.items) {
    ASSERT_GE(item.where.line, 1u);
    ASSERT_GE(item.where.column, 1u);
    ASSERT_FALSE(item.message.empty());
    ASSERT_FALSE(item.code.empty());
    ASSERT_FALSE(item.where.file.empty());
  }
}

TEST(HostileInput, Listing1CutAnywhereIsAnError) {
  const std::string listing(kListing1);
  const std::string with_root = "<behaviors>\n" + listing + "</behaviors>";
  for (std::size_t length = 0; length < with_root.size(); ++length) {
    const Loaded loaded = load_text(with_root.substr(0, length));
    ASSERT_TRUE(loaded.has_errors) << with_root.substr(0, length);
    expect_places(loaded);
  }
  // Without a root, what is cut between two elements may happen to be a model.
  const std::size_t define = listing.find("</define>") + std::string("</define>").size();
  const std::size_t meta_behaviour = listing.find("<meta_behavior");
  for (std::size_t length = 0; length < listing.size() - 1; ++length) {
    const Loaded loaded = load_text(listing.substr(0, length));
    const bool is_model = length >= define && length <= meta_behaviour;
    ASSERT_EQ(loaded.has_errors, !is_model) << listing.substr(0, length);
    expect_places(loaded);
  }
}

TEST(HostileInput, AnApplicationCutAnywhereIsAnError) {
  const std::string whole =
      "<?xml version='1.0'?><!-- c --><application><name>x &amp; y</name><connection id='1'>"
      "<from>/s</from><to><![CDATA[/p]]></to></connection></application>";
  for (std::size_t length = 0; length < whole.size(); ++length) {
    const Loaded loaded = load_with_application("<behaviors/>", whole.substr(0, length));
    ASSERT_TRUE(loaded.has_errors) << whole.substr(0, length);
    expect_places(loaded);
  }
}

TEST(HostileInput, AnyByteChangedGivesAnAnswer) {
  constexpr unsigned kSeed = 90210;
  std::mt19937 random(kSeed);
  const Folder folder;
  const std::string base =
      "<behaviors timeout='1s'>" + std::string(kListing1) +
      "<source port='/x' timeout='forever'/><arbiter at='/p' conflict='first'>"
      "<select from='/s'>any(/a*) &amp;&amp; (/b -> \"/c\") <![CDATA[<-> /d]]></select></arbiter>"
      "<!-- c --></behaviors>";
  static constexpr std::string_view kBytes = "<>&;'\"/=!-[]?#${}() \n\t,*a0\xc3\xa4\xff\x01";
  for (int i = 0; i < 1'500; ++i) {
    std::string model = base;
    for (auto left = 1 + random() % 3; left > 0; --left) {
      const std::size_t at = random() % model.size();
      const char byte = kBytes[random() % kBytes.size()];
      switch (random() % 3) {
        case 0:
          model[at] = byte;
          break;
        case 1:
          model.insert(at, 1, byte);
          break;
        default:
          model.erase(at, 1 + random() % 5);
          break;
      }
    }
    const std::string path = folder.write("a.xml", model);
    expect_places(load_files({{path}, {}}));
    expect_places(load_files({{}, path}));
    if (HasFatalFailure()) FAIL() << "seed " << kSeed << ", model " << i << ":\n" << model;
  }
}

std::string times_over(const std::string& text, int times) {
  std::string result;
  for (int i = 0; i < times; ++i) result += text;
  return result;
}

TEST(HostileInput, MadeToBeDeepOrLongEndsSoonWithAnError) {
  const int many = 100'000;
  const std::string select = "<arbiter at='/p'><select from='/s'>";
  const std::string end = "</select></arbiter>";
  for (const std::string& model : {
           times_over("<a>", many) + times_over("</a>", many),
           times_over("<behaviors>", many),
           times_over("<meta_behavior name='M'>", many) + times_over("</meta_behavior>", many),
           times_over("<!--", many),
           times_over("<![CDATA[", many),
           times_over("<?", many),
           times_over("<!DOCTYPE a [", many),
           times_over("&lt;", many),
           times_over("<a ", many),
           times_over("\"", many),
           "<a " + times_over("a='' ", many) + "/>",
           "<source " + times_over("port='/a' ", 3'000) + "/>",
           "<" + times_over("a", many) + "/>",
           "<behavior name='" + times_over("a", many) + "'/>",
           "<behavior name='B'><inhibition>" + times_over("X,", many) + "</inhibition></behavior>",
           "<source port='/" + times_over("${", many) + "'/>",
           "<source port='/" + times_over("${a}", many) + "'/>",
           "<define name='a'>" + times_over("a", many) + "</define><source port='/${a}'/>",
           select + times_over("(", many) + end,
           select + times_over("not ", many) + end,
           select + times_over("/a -> ", many) + "/a" + end,
           select + times_over("/a xor ", many) + "/a" + end,
           select + "\"" + times_over("a", many) + end,
           select + "/" + times_over("a", many) + end,
           times_over("<x/>", many),
           times_over("<behavior/>", many),
       }) {
    const Stopwatch stopwatch;
    const Loaded loaded = load_text(model);
    EXPECT_TRUE(loaded.has_errors) << model.substr(0, 40);
    EXPECT_LT(stopwatch.seconds(), 15.0) << model.substr(0, 40);
    expect_places(loaded);
    std::size_t bytes = 0;
    for (const Diagnostic& item : loaded.items) bytes += item.message.size();
    EXPECT_LT(bytes / loaded.items.size(), 1'000u) << "messages of a length that can be read";
  }
}

TEST(HostileInput, EntitiesOfADocumentTypeAreNotExpanded) {
  const Loaded loaded = load_text(
      "<!DOCTYPE b [<!ENTITY lol \"lol\"><!ENTITY x SYSTEM \"/etc/passwd\">]>\n"
      "<behaviors><source port='/&lol;'/><source port='/&x;'/></behaviors>");
  EXPECT_THAT(loaded.findings(),
              testing::ElementsAre("2:27 error malformed-xml", "2:50 error malformed-xml"));
  EXPECT_THAT(loaded.message(), HasSubstr("&lol; names no character"));
}

}  // namespace
}  // namespace arbiter::rules
