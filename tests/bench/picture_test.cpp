// The picture of a report's targets.
#include "bench/harness/picture.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "bench/harness/report.hpp"
#include "rules/text/xml.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::bench {
namespace {

using test::content_of;
using testing::HasSubstr;
using testing::Not;

const std::string kFigures = ARBITER_SOURCE "/docs/figures/";

Report judged_report() {
  Report report;
  report.machine = {
      {"date", "2026-01-02 03:04 UTC"}, {"processor", "Robot PC 9000"}, {"usable processors", 2}};
  report.targets = {{"spinning, to <iceoryx> & \"others\"", 0.3, 0.25, "x"},
                    {"blocking, to a pipe", 0.5, 0.75, "x"},
                    {"to a system that is missing", 0.5, {}, "x"},
                    {"take()", 50, 30, "ns"},
                    {"attach", 1e9, 7.5e8, "ns"},
                    {"idle daemon", 0, 0, "%"}};
  return report;
}

// Of an element or attribute that is not well-formed the reader says where.
void expect_well_formed(const std::string& svg) {
  rules::Diagnostics diagnostics;
  const rules::TextFile file("picture.svg", svg);
  EXPECT_TRUE(rules::parse_xml(file, diagnostics));
  EXPECT_FALSE(diagnostics.has_errors());
}

TEST(Picture, IsWellFormedAndHasEachTarget) {
  const std::string svg = picture(judged_report().json());
  expect_well_formed(svg);
  EXPECT_THAT(svg, HasSubstr(">spinning, to &lt;iceoryx> &amp; &quot;others&quot;</text>"));
  for (const Verdict& target : judged_report().targets) {
    if (target.name.find('<') != std::string::npos) continue;
    EXPECT_THAT(svg, HasSubstr(">" + target.name + "</text>"));
  }
}

TEST(Picture, SaysWhereAndWhenAndWithWhatItWasMeasured) {
  Report report = judged_report();
  EXPECT_THAT(picture(report.json()), HasSubstr("2026-01-02 03:04 UTC · Robot PC 9000 · 2 usable"));
  EXPECT_THAT(picture(report.json()), HasSubstr("./run bench: 4 of 6 targets met"));
  report.quick = true;
  EXPECT_THAT(picture(report.json()), HasSubstr("./run bench --quick: "));
}

// Honest: what is missed and what could not be measured is in it, and looks so.
TEST(Picture, HidesNothing) {
  const std::string svg = picture(judged_report().json());
  EXPECT_THAT(svg, HasSubstr("0.75 ×  ✗ over 0.5 ×"));
  EXPECT_THAT(svg, HasSubstr("not measured"));
  EXPECT_THAT(svg, HasSubstr("750 ms"));
  EXPECT_THAT(svg, HasSubstr("0 %"));
}

TEST(Picture, GatewaysHaveAGroupOfTheirOwn) {
  Report report;
  EXPECT_THAT(picture(report.json()), Not(HasSubstr("Through a gateway")));
  report.targets = {{"DDS gateway, 64 B, p50, to a relay", 1.15, 1.1, "x", kGateways}};
  EXPECT_THAT(picture(report.json()), HasSubstr("Through a gateway"));
  EXPECT_THAT(picture(report.json()), Not(HasSubstr("Beside others")));
}

TEST(Picture, SaysWhatMayHaveSpoiltTheFigures) {
  Report report = judged_report();
  report.warnings = {"Noisy neighbours", "Only one processor may be used."};
  EXPECT_THAT(picture(report.json()), HasSubstr("⚠ Noisy neighbours</text>"));
  EXPECT_THAT(picture(report.json()), HasSubstr("⚠ Only one processor may be used.</text>"));
}

TEST(Picture, OfFiguresThatNoAxisHoldsIsWellFormed) {
  Report report;
  report.targets = {{"a", 1e300, 1e-300, "x"}, {"b", 0, 0, "x"}, {"c", 1, 1e308, "ns"}};
  report.machine = {{"processor", "bad \xff byte, \x01"}};
  expect_well_formed(picture(report.json()));
}

TEST(Picture, OfAReportWithoutTargetsSaysSo) {
  const std::string svg = picture(Report{}.json());
  expect_well_formed(svg);
  EXPECT_THAT(svg, HasSubstr("Nothing was measured that has a target."));
}

TEST(Picture, OfWhatIsNoReportIsNone) {
  EXPECT_THROW(picture(nlohmann::json::object()), std::runtime_error);
}

// docs/contributing.md says how it is drawn again.
TEST(Picture, OfTheReadmeIsOfItsReport) {
  const auto report = nlohmann::json::parse(content_of(kFigures + "report.json"));
  EXPECT_EQ(content_of(kFigures + "figures.svg"), picture(report));
  EXPECT_THAT(content_of(ARBITER_SOURCE "/README.md"), HasSubstr("(docs/figures/figures.svg)"));
}

// One set of figures: those of the picture stand in the page's table, and no others.
TEST(Picture, OfTheReadmeHasTheFiguresOfTheTable) {
  const auto report = nlohmann::json::parse(content_of(kFigures + "report.json"));
  const std::string page = content_of(ARBITER_SOURCE "/docs/performance.md");
  for (const auto& target : report.at("targets")) {
    const auto name = target.at("name").get<std::string>();
    const auto row = page.find("\n| " + name + " | ");
    ASSERT_NE(row, std::string::npos) << name;
    const std::string line = page.substr(row + 1, page.find('\n', row + 1) - row - 1);
    auto measured = target.at("measured").get<double>();
    if (line.find(" ms |") != std::string::npos) measured /= 1e6;
    std::size_t cell = line.find(" | ");    // behind the name
    cell = line.find(" | ", cell + 1) + 3;  // and the limit
    EXPECT_DOUBLE_EQ(std::stod(line.substr(cell)), measured) << line;
    EXPECT_EQ(line.find("| met |") != std::string::npos, target.at("met").get<bool>()) << line;
  }
}

}  // namespace
}  // namespace arbiter::bench
