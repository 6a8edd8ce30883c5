#include "rules/text/xml.hpp"

#include <gmock/gmock.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/rules/model_text.hpp"

namespace arbiter::rules {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// Elements as name[attribute=value](children), texts in quotes.
std::string show(const XmlNode* node) {
  std::string result;
  for (; node != nullptr; node = node->next) {
    if (!result.empty()) result += ' ';
    if (node->kind != XmlKind::kElement) {
      result += (node->kind == XmlKind::kCData ? "C'" : "'") + std::string(node->text) + "'";
      continue;
    }
    result += std::string(node->text);
    for (const XmlAttribute& attribute : node->attributes) {
      result += "[" + std::string(attribute.name) + "=" + std::string(attribute.value) + "]";
    }
    if (node->first_child != nullptr) result += "(" + show(node->first_child) + ")";
  }
  return result;
}

std::string parsed(const std::string& content) {
  const TextFile file("f", content);
  Diagnostics diagnostics;
  const auto document = parse_xml(file, diagnostics);
  if (document) return show(document->first());
  const Diagnostic& item = diagnostics.items().at(0);
  EXPECT_EQ(diagnostics.items().size(), 1u);
  EXPECT_EQ(item.code, "malformed-xml");
  return std::to_string(item.where.line) + ":" + std::to_string(item.where.column) + " " +
         item.message;
}

TEST(Xml, IsReadAsItStandsInTheFile) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"<a/>", "a"},
      {"<a></a>", "a"},
      {"<a><b/><c><d/></c></a>", "a(b c(d))"},
      {"<a><b><c/></b></a><d/>", "a(b(c)) d"},
      {"<a x='1' y=\"2\"/>", "a[x=1][y=2]"},
      {"<a x=''/>", "a[x=]"},
      {"<a>&amp;\r\n</a>", "a('&amp;\r\n')"},
      {"<a x='&lt;\t'/>", "a[x=&lt;\t]"},
      {"<a>t<!-- c -->u</a>", "a('t' 'u')"},
      {"<a><![CDATA[<&]]> <![CDATA[]]></a>", "a(C'<&' ' ' C'')"},
      {"<?xml version='1.0'?><!DOCTYPE a [<!ENTITY x 'y'>]><?p i?><a/>", "a"},
      {"t<a/>u", "'t' a 'u'"},
      {"", ""},
      {"<ä ö='ü'/>", "ä[ö=ü]"},
  };
  for (const auto& [content, tree] : cases) EXPECT_EQ(parsed(content), tree) << content;
}

TEST(Xml, MalformedIsReportedWhereItBeginsToBe) {
  struct Case {
    std::string content, place, message;
  };
  const std::vector<Case> cases{
      {"<a>\n<b>\n</a>", "3:1", "does not fit <b> of f:2:1"},
      {"<a>\n<b x='>'>\n<c/>\n</a>", "4:1", "does not fit <b> of f:2:1"},
      {"<a>\n  <b>\n", "2:6", "the file ends before <b> of f:2:3 is closed"},
      {"<a>\n  <b/>\n text \n\n", "3:6", "the file ends before <a> of f:1:1 is closed"},
      {"<!-- <x> --><a><![CDATA[<y>]]><?z?>", "1:36", "before <a> of f:1:13"},
      {"</a>", "1:1", "closes nothing"},
      {"<a/>\n</b>", "2:1", "closes nothing"},
      {"<a></a", "1:4", "does not end"},
      {"<a></", "1:4", "does not end"},
      {"<a></a b>", "1:4", "more in it than a name"},
      {"<a", "1:1", "malformed or does not end"},
      {"<a><b ", "1:4", "malformed or does not end"},
      {"<a>\n<b c='d", "2:1", "an attribute of this tag is malformed"},
      {"<a>\n<b c=d/></a>", "2:1", "an attribute of this tag is malformed"},
      {"<a b/>", "1:1", "an attribute of this tag is malformed"},
      {"<a b='1'c='2'/>", "1:1", "an attribute of this tag is malformed"},
      {"<a>\n <b c=\"d>\n <e f=\"g\"/></b></a>", "2:2", "an attribute of this tag is malformed"},
      {"<a> < </a>", "1:5", "write &lt;"},
      {"<a>1 <2</a>", "1:6", "write &lt;"},
      {"<a/><", "1:5", "write &lt;"},
      {"<a>/x <-> /y</a>", "1:7", "write iff for this operator"},
      {"<condition>/x < /y</condition>", "1:15", "a condition compares nothing"},
      {"<select>/x <= /y</select>", "1:12", "write implies, and what follows behind it"},
      {"<a/>\n<!-- b", "2:1", "close it with -->"},
      {"<a><![CDATA[b", "1:4", "close it with ]]>"},
      {"<?xml version='1.0'", "1:1", "close it with ?>"},
      {"<!DOCTYPE a [", "1:1", "document type"},
      {"<a/>\n<!", "2:1", "write &lt;"},
  };
  for (const Case& c : cases) {
    EXPECT_THAT(parsed(c.content), HasSubstr(c.message)) << c.content;
    EXPECT_EQ(parsed(c.content).substr(0, c.place.size() + 1), c.place + " ") << c.content;
  }
}

// Whoever has mended only what was told would be refused again.
TEST(Xml, ReferencesInFrontOfWhatIsMalformedAreReportedBesideIt) {
  const auto places = [](const std::string& content) {
    const TextFile file("f", content);
    Diagnostics diagnostics;
    EXPECT_FALSE(parse_xml(file, diagnostics));
    std::vector<unsigned> columns;
    for (const auto& item : diagnostics.items()) columns.push_back(item.where.column);
    return columns;
  };
  EXPECT_THAT(places("<a><b>x && y</b><c>x &amp; y & z < u</c></a>"), ElementsAre(9, 30, 34));
  EXPECT_THAT(places("<a b='&'><!-- & --><![CDATA[ & ]]> < & </a>"), ElementsAre(36));
  EXPECT_THAT(places("<application><name>x & y</name></b>"), ElementsAre(32))
      << "not ours to judge";
}

TEST(Xml, ReferencesAreDecodedAndKeepTheirPlace) {
  const std::string content = "x&amp;y&#228;&#x2192;z";
  const TextFile file("f", content);
  Diagnostics diagnostics;
  Text text(file, 0);
  ASSERT_TRUE(decode(file, file.content(), text, diagnostics));
  EXPECT_EQ(text.bytes(), "x&yä→z");
  std::vector<unsigned> columns;
  for (std::size_t i = 0; i <= text.bytes().size(); ++i) columns.push_back(text.where(i).column);
  EXPECT_THAT(columns, ElementsAre(1, 2, 7, 8, 8, 14, 14, 14, 22, 23));
}

TEST(Xml, ReferencesToNoCharacterAreErrors) {
  for (const std::string bad : {"&",
                                "& ",
                                "&amp",
                                "&amp ;",
                                "&;",
                                "&#;",
                                "&#x;",
                                "&nbsp;",
                                "&AMP;",
                                "&#0;",
                                "&#1;",
                                "&#127;",
                                "&#x110000;",
                                "&#xd800;",
                                "&#-1;",
                                "&#+65;",
                                "&#x 41;",
                                "&#99999999999;",
                                "&#xfffffffffff;",
                                "&#65a;",
                                "&aaaaaaaaaaaaaaaaaaaaaaaaa;"}) {
    const std::string content = "ab" + std::string(bad) + "c";
    const TextFile file("f", content);
    Diagnostics diagnostics;
    Text text(file, 0);
    EXPECT_FALSE(decode(file, file.content(), text, diagnostics)) << bad;
    ASSERT_EQ(diagnostics.items().size(), 1u) << bad;
    EXPECT_EQ(diagnostics.items()[0].code, "malformed-xml");
    EXPECT_EQ(diagnostics.items()[0].where, (Location{"f", 1, 3}));
    EXPECT_THAT(diagnostics.items()[0].message, HasSubstr("&amp;"));
  }
}

TEST(Xml, OfAnyDepthIsReadWithoutRecursion) {
  std::string content;
  for (int i = 0; i < 200'000; ++i) content += "<a>";
  const TextFile open("f", content);
  Diagnostics diagnostics;
  EXPECT_FALSE(parse_xml(open, diagnostics));
  for (int i = 0; i < 200'000; ++i) content += "</a>";
  const TextFile closed("f", content);
  EXPECT_TRUE(parse_xml(closed, diagnostics));
}

// Root, and what is in it: each with the bytes of the whole element, and where its end tag begins.
std::string show(const std::optional<Outline>& outline, std::string_view content) {
  if (!outline) return "none";
  const auto element = [&](std::string_view name, const Extent& extent) {
    return std::string(name) + "=" +
           std::string(content.substr(extent.begin, extent.inner_end - extent.begin)) + "|" +
           std::string(content.substr(extent.inner_end, extent.end - extent.inner_end));
  };
  std::string result = element(outline->root, outline->extent);
  for (const auto& [name, extent] : outline->children) result += " + " + element(name, extent);
  return result;
}

TEST(XmlOutline, TellsWhereElementsBeginAndEnd) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"<a/>", "a=<a/>|"},
      {"<a></a>", "a=<a>|</a>"},
      {"<?xml?><!-- <x> --><a b='>'/> ", "a=<a b='>'/>|"},
      {"<a><b c='1'/>t<d><b/></d></a>",
       "a=<a><b c='1'/>t<d><b/></d>|</a> + b=<b c='1'/>| + "
       "d=<d><b/>|</d>"},
      {"<a><![CDATA[</a>]]><!-- </a> --></a>", "a=<a><![CDATA[</a>]]><!-- </a> -->|</a>"},
      {"<!DOCTYPE a [<!-- > <x> --><!ENTITY y '<z>'>]><a/>", "a=<a/>|"},
      {"", "none"},
      {"<a>", "none"},
      {"</a>", "none"},
      {"<a/><b/>", "a=<a/>|"},
      {"<a></a></b>", "a=<a>|</a>"},
      {"<a", "none"},
      {"<a><!-- </a>", "none"}};
  for (const auto& [content, expected] : cases) {
    EXPECT_EQ(show(outline(content), content), expected) << content;
    if (expected != "none") {
      EXPECT_EQ(root_name(content), "a") << content;
    }
  }
}

}  // namespace
}  // namespace arbiter::rules
