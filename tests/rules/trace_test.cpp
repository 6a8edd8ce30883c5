#include "rules/explain/trace.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tuple>

#include "rules/model/load.hpp"
#include "rules/text/csv.hpp"

namespace arbiter::test {
namespace {

using rules::Diagnostics;
using rules::TraceEvent;
using rules::TraceKind;
using testing::ElementsAre;
using testing::IsEmpty;

using Event = std::tuple<shm::Nanoseconds, TraceKind, std::string>;

std::vector<Event> events_of(const std::string& text, Diagnostics& diagnostics) {
  const rules::TextFile file("trace.csv", text);
  std::vector<Event> result;
  for (auto& event : parse_trace(file, diagnostics)) {
    result.emplace_back(event.at, event.kind, event.source);
  }
  return result;
}

std::vector<Event> good_events_of(const std::string& text) {
  Diagnostics diagnostics;
  auto events = events_of(text, diagnostics);
  EXPECT_THAT(diagnostics.items(), IsEmpty());
  return events;
}

// "line:column code" of each problem.
std::vector<std::string> problems_of(const std::string& text) {
  Diagnostics diagnostics;
  events_of(text, diagnostics);
  std::vector<std::string> result;
  for (const auto& item : diagnostics.items()) {
    EXPECT_EQ(item.where.file, "trace.csv");
    EXPECT_EQ(item.severity, rules::Severity::kError);
    result.push_back(std::to_string(item.where.line) + ":" + std::to_string(item.where.column) +
                     " " + item.code);
  }
  return result;
}

TEST(Trace, ListsArrivals) {
  EXPECT_THAT(good_events_of("t_ns,source\n0,/a\n0,/b\n5,/a\n"),
              ElementsAre(Event{0, TraceKind::kArrival, "/a"}, Event{0, TraceKind::kArrival, "/b"},
                          Event{5, TraceKind::kArrival, "/a"}));
}

TEST(Trace, TellsArrivalsDeactivationsAndTicksApart) {
  EXPECT_THAT(good_events_of("t_ns,source,event\n1,/a,arrive\n2,/a,\n3,/a,deactivate\n4,,\n"
                             "5,,arrive\n"),
              ElementsAre(Event{1, TraceKind::kArrival, "/a"}, Event{2, TraceKind::kArrival, "/a"},
                          Event{3, TraceKind::kDeactivation, "/a"}, Event{4, TraceKind::kTick, ""},
                          Event{5, TraceKind::kTick, ""}));
}

TEST(Trace, OfTwoColumnsMayTickToo) {
  EXPECT_THAT(good_events_of("t_ns,source\n7,\n"), ElementsAre(Event{7, TraceKind::kTick, ""}));
}

TEST(Trace, TakesBlankLinesCrlfAByteOrderMarkAndNoFinalNewline) {
  EXPECT_THAT(
      good_events_of("\xef\xbb\xbf\r\nt_ns,source\r\n\r\n  \t\r\n1,/a\r\n\n2,/b"),
      ElementsAre(Event{1, TraceKind::kArrival, "/a"}, Event{2, TraceKind::kArrival, "/b"}));
}

TEST(Trace, TakesQuotedFieldsAsRfc4180HasThem) {
  EXPECT_THAT(
      good_events_of("\"t_ns\",\"source\"\n\"1\",\"/left, arm\"\n2,\"/say \"\"hi\"\"\"\n"
                     "3,\"/two\nlines\"\n4,\"\"\n"),
      ElementsAre(Event{1, TraceKind::kArrival, "/left, arm"},
                  Event{2, TraceKind::kArrival, "/say \"hi\""},
                  Event{3, TraceKind::kArrival, "/two\nlines"}, Event{4, TraceKind::kTick, ""}));
}

TEST(Trace, MayBeOnlyAHeader) { EXPECT_THAT(good_events_of("t_ns,source,event\n"), IsEmpty()); }

TEST(Trace, TakesTheLastTimeThereIs) {
  EXPECT_THAT(good_events_of("t_ns,source\n2305843009213693951,/a\n"),
              ElementsAre(Event{shm::kMaxTime, TraceKind::kArrival, "/a"}));
}

TEST(Trace, NeedsAHeader) {
  EXPECT_THAT(problems_of(""), ElementsAre("1:1 trace-header"));
  EXPECT_THAT(problems_of("\n\n"), ElementsAre("1:1 trace-header"));
  EXPECT_THAT(problems_of("\n0,/a\n"), ElementsAre("2:1 trace-header"));
  EXPECT_THAT(problems_of("t_ns\n"), ElementsAre("1:1 trace-header"));
  EXPECT_THAT(problems_of("source,t_ns\n"), ElementsAre("1:1 trace-header"));
  EXPECT_THAT(problems_of("t_ns,source,event,more\n"), ElementsAre("1:1 trace-header"));
  EXPECT_THAT(problems_of("t_ns, source\n"), ElementsAre("1:1 trace-header"));
}

TEST(Trace, RefusesTimesThatAreNone) {
  EXPECT_THAT(problems_of("t_ns,source\n-1,/a\n+1,/a\n1.5,/a\n1e3,/a\n,/a\n 1,/a\n0x1,/a\n1 ,/a\n"),
              ElementsAre("2:1 trace-time", "3:1 trace-time", "4:1 trace-time", "5:1 trace-time",
                          "6:1 trace-time", "7:1 trace-time", "8:1 trace-time", "9:1 trace-time"));
  EXPECT_THAT(problems_of("t_ns,source\n2305843009213693952,/a\n99999999999999999999,/a\n"),
              ElementsAre("2:1 trace-time", "3:1 trace-time"));
}

TEST(Trace, TimesNeverFall) {
  EXPECT_THAT(problems_of("t_ns,source\n5,/a\n4,/a\n5,/a\n3,\n"),
              ElementsAre("3:1 trace-order", "5:1 trace-order"));
}

TEST(Trace, EachLineHasTheFieldsOfTheHeader) {
  EXPECT_THAT(problems_of("t_ns,source\n1\n1,/a,arrive\n"),
              ElementsAre("2:1 trace-fields", "3:6 trace-fields"));
  EXPECT_THAT(problems_of("t_ns,source,event\n1,/a\n1,/a,,\n"),
              ElementsAre("2:3 trace-fields", "3:7 trace-fields"));
  Diagnostics diagnostics;
  events_of("t_ns,source\n1\n", diagnostics);
  ASSERT_EQ(diagnostics.items().size(), 1u);
  EXPECT_EQ(diagnostics.items()[0].message,
            "this line has 1 field, and the header 2; write as many in each line");
}

TEST(Trace, RefusesOtherEvents) {
  EXPECT_THAT(problems_of("t_ns,source,event\n1,/a,leave\n1,/a,Arrive\n1,/a, arrive\n"),
              ElementsAre("2:6 trace-event", "3:6 trace-event", "4:6 trace-event"));
}

TEST(Trace, ADeactivationNeedsASource) {
  EXPECT_THAT(problems_of("t_ns,source,event\n1,,deactivate\n"), ElementsAre("2:3 trace-source"));
}

TEST(Trace, SaysWhereAQuoteIsWrongAndGoesOn) {
  EXPECT_THAT(
      problems_of("t_ns,source\n1,/a\"b\n1,\"/a\"b\nx,/a\n1,\"/open\n2,/a\n"),
      ElementsAre("2:5 malformed-csv", "3:7 malformed-csv", "4:1 trace-time", "5:3 malformed-csv"));
}

TEST(Trace, ReportsAllProblemsInOneGo) {
  EXPECT_THAT(problems_of("t_ns,source,event\nx,/a,bad\n1\n2,,deactivate\n1,/a,\n"),
              ElementsAre("2:1 trace-time", "2:6 trace-event", "3:1 trace-fields",
                          "4:3 trace-source", "5:1 trace-order"));
}

TEST(Trace, ThatCannotBeOpenedOrReadIsAFileError) {
  Diagnostics diagnostics;
  EXPECT_THROW(rules::read_trace("/nowhere/trace.csv", diagnostics), rules::FileError);
  EXPECT_THROW(rules::read_trace("/", diagnostics), rules::FileError);
}

TEST(Csv, QuotesWhatNeedsIt) {
  EXPECT_EQ(rules::to_csv("/plain"), "/plain");
  EXPECT_EQ(rules::to_csv(""), "");
  EXPECT_EQ(rules::to_csv("a,b"), "\"a,b\"");
  EXPECT_EQ(rules::to_csv("a\"b"), "\"a\"\"b\"");
  EXPECT_EQ(rules::to_csv("a\r\nb"), "\"a\r\nb\"");
}

TEST(Csv, WhatIsWrittenReadsBack) {
  for (const std::string value : {"x", "a,b", "\"", "\"\"", ",", "a\nb", "a\r\nb", " x "}) {
    Diagnostics diagnostics;
    const rules::TextFile file("f.csv", rules::to_csv(value) + "," + rules::to_csv(value) + "\n");
    const auto record = rules::CsvReader(file, diagnostics).next();
    ASSERT_TRUE(record.has_value());
    ASSERT_EQ(record->size(), 2u);
    EXPECT_EQ((*record)[0].value, value);
    EXPECT_EQ((*record)[1].value, value);
    EXPECT_THAT(diagnostics.items(), IsEmpty());
  }
}

}  // namespace
}  // namespace arbiter::test
