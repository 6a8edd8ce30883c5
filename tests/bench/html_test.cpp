// The page that is made of a report.
#include "bench/harness/html.hpp"

#include <gmock/gmock.h>

#include "bench/harness/report.hpp"

namespace arbiter::bench {
namespace {

using testing::HasSubstr;
using testing::Not;

const std::string kData = "<script type=\"application/json\" id=\"data\">";
const std::string kEnd = "</script>";

std::size_t count_of(const std::string& what, const std::string& text) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) {
    ++count;
  }
  return count;
}

Report some_report() {
  Report report;
  report.quick = true;
  report.machine = {{"processor", "Robot PC 9000"}};
  report.warnings = {"Noisy neighbours"};
  Histogram ns;
  for (int i = 1; i <= 1000; ++i) ns.add(i);
  Measure delivery{"delivery", "One-way delivery", "Half a round trip."};
  delivery.cases.push_back({"64 B, spinning",
                            64,
                            {{"arbiter", Role::kOurs, ns, {}, {}},
                             {"broken", Role::kPeer, {}, {}, "</script><!-- <script> it said"}}});
  Measure throughput{"throughput", "Throughput", "Flat out.", "1/s"};
  throughput.cases.push_back({"64 B", {}, {{"arbiter", Role::kOurs, {}, 1e6, {}}}});
  report.measures = {delivery, throughput};
  report.targets = {{"to a cache line", 3, 2.5, "x"}, {"to iceoryx", 0.3, {}, "x"}};
  return report;
}

nlohmann::json data_in(const std::string& page) {
  const auto begin = page.find(kData) + kData.size();
  return nlohmann::json::parse(page.substr(begin, page.find(kEnd, begin) - begin));
}

TEST(Html, HoldsTheWholeReport) {
  const nlohmann::json report = some_report().json();
  const std::string page = html(report);
  EXPECT_EQ(count_of(kData, page), 1u);
  EXPECT_EQ(data_in(page), report);
}

TEST(Html, MentionsAllMeasuresTargetsAndWarnings) {
  const std::string page = html(some_report().json());
  for (const char* const text : {"One-way delivery", "Throughput", "to a cache line", "to iceoryx",
                                 "Noisy neighbours", "Robot PC 9000"}) {
    EXPECT_THAT(page, HasSubstr(text));
  }
}

TEST(Html, WhatANoteSaysCannotEndTheScript) {
  const nlohmann::json report = some_report().json();
  const std::string page = html(report);
  EXPECT_EQ(count_of(kEnd, page), 2u) << "of the data, and of the script";
  EXPECT_EQ(count_of("<!--", page), 0u);
  EXPECT_EQ(count_of("<script", page), 2u);
  EXPECT_EQ(data_in(page)["measures"][0]["cases"][0]["results"][1]["note"],
            "</script><!-- <script> it said")
      << "and it is read as it was said";
}

TEST(Html, ANoteNeedNotBeUtf8) {
  Report report = some_report();
  report.warnings = {"bad \xff byte"};
  EXPECT_EQ(data_in(html(report.json()))["warnings"][0], "bad \xEF\xBF\xBD byte");
}

TEST(Html, ANoteThatLooksLikeAPlaceOfThePageIsLeftAlone) {
  Report report = some_report();
  report.warnings = {"{{scripts}}"};
  const std::string page = html(report.json());
  EXPECT_EQ(data_in(page)["warnings"][0], "{{scripts}}");
  EXPECT_EQ(count_of("{{", page), 1u) << "and all places of the page are filled";
}

TEST(Html, NeedsNoNetwork) {
  const std::string page = html(some_report().json());
  for (const char* const text : {" src=", "@import", "url(", "fetch(", "<link"}) {
    EXPECT_THAT(page, Not(HasSubstr(text)));
  }
  // The one address is a name: that of SVG's elements.
  EXPECT_EQ(count_of("http", page), 1u);
  EXPECT_THAT(page, HasSubstr("http://www.w3.org/2000/svg"));
}

}  // namespace
}  // namespace arbiter::bench
