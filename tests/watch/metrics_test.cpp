// A status as metrics: each field of the document has its metric, or a reason for having none.
#include "watch/metrics.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <set>
#include <string>

#include "tests/support/documented_fields.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/page_tables.hpp"
#include "tests/support/prometheus.hpp"
#include "tests/support/run_program.hpp"
#include "tests/support/text_files.hpp"
#include "tests/wire/full_status.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;

std::string page(const std::string& name) {
  return content_of(std::string(ARBITER_SOURCE) + "/docs/" + name);
}

std::map<std::string, Metric> full_metrics() {
  return read_metrics(watch::metrics_of(full_status()));
}

TEST(Metrics, HaveTheValuesOfTheStatus) {
  auto metrics = full_metrics();
  const auto value = [&](const std::string& name, const MetricLabels& labels) {
    const auto& samples = metrics.at(name).samples;
    const auto found = samples.find(labels);
    return found == samples.end() ? NAN : found->second;
  };
  EXPECT_EQ(value("arbiter_up", {}), 1);
  EXPECT_EQ(value("arbiter_daemon_info", {{"name", "x"}, {"pid", "42"}}), 1);
  EXPECT_EQ(value("arbiter_model_generation", {}), 7);
  EXPECT_EQ(value("arbiter_model_info",
                  {{"name", "work"}, {"files", "a.xml,b.xml"}, {"application", "app.xml"}}),
            1);
  EXPECT_EQ(value("arbiter_model_in_force_timestamp_seconds", {}), 1'795'323'981.354);
  EXPECT_EQ(value("arbiter_reloads_refused_total", {}), 2);
  EXPECT_EQ(value("arbiter_source_samples_published_total", {{"source", "/face"}}), 101);
  EXPECT_EQ(value("arbiter_source_arrivals_late_total", {{"source", "/face"}}), 109);
  EXPECT_EQ(value("arbiter_source_sample_bytes", {{"source", "/face"}}), 24);
  EXPECT_EQ(value("arbiter_source_timeout_seconds", {{"source", "/face"}}), 0.5);
  EXPECT_EQ(value("arbiter_source_timeout_seconds", {{"source", "/stop"}}), INFINITY);
  EXPECT_EQ(value("arbiter_source_active", {{"source", "/stop"}}), 1);
  EXPECT_EQ(value("arbiter_source_away", {{"source", "/stop"}}), 1);
  EXPECT_EQ(value("arbiter_source_trouble", {{"source", "/face"}}), 1);
  EXPECT_EQ(value("arbiter_source_trouble", {{"source", "/stop"}}), 0);
  EXPECT_EQ(value("arbiter_port_trouble", {{"port", "/gaze"}}), 1);
  EXPECT_EQ(value("arbiter_port_samples_taken_total", {{"port", "/gaze"}}), 201);
  EXPECT_EQ(value("arbiter_port_idles_total", {{"port", "/gaze"}}), 207);
  EXPECT_EQ(value("arbiter_port_winner_cannot_deliver", {{"port", "/idle"}}), 1);
  const MetricLabels connection{{"port", "/gaze"}, {"source", "/face"}};
  EXPECT_EQ(value("arbiter_connection_winner", connection), 1);
  EXPECT_EQ(value("arbiter_connection_samples_accepted_total", connection), 301);
  EXPECT_EQ(value("arbiter_connection_samples_waiting", connection), 307);
  EXPECT_EQ(value("arbiter_connection_mismatch", {{"port", "/gaze"}, {"source", "/bytes"}}), 1);
  EXPECT_TRUE(std::isnan(value("arbiter_source_signals_total", {{"source", "/stop"}})))
      << "it is not open here";
}

// No two counters may be mixed up: full_status() has no value twice.
TEST(Metrics, HaveEachCounterOnce) {
  std::multiset<double> values;
  for (const auto& [name, metric] : full_metrics()) {
    for (const auto& [labels, value] : metric.samples) {
      if (metric.type == "counter" && value > 100) values.insert(value);
    }
  }
  std::multiset<double> expected;
  for (int i = 101; i <= 109; ++i) expected.insert(i);
  for (int i = 201; i <= 207; ++i) expected.insert(i);
  for (int i = 301; i <= 306; ++i) expected.insert(i);
  EXPECT_EQ(values, expected);
}

TEST(Metrics, OfEachFieldAreOnThePage) {
  std::set<std::string> fields, named;
  for (const PageRow& row : rows_of(page("watching.md"), {"field", "metric"})) {
    for (const std::string& field : quoted(row.cells.at(0))) {
      EXPECT_TRUE(fields.insert(field).second) << field << " is on the page twice";
    }
    for (const std::string& word : quoted(row.cells.at(1))) {
      if (word.starts_with("arbiter_")) named.insert(word);
    }
  }
  const auto documented = documented_fields(page("status.md"));
  for (const auto& [path, field] : documented) {
    if (!field.types.contains("integer") && !field.types.contains("boolean")) continue;
    EXPECT_TRUE(fields.contains(path)) << path << " has neither a metric nor a reason on the page";
  }
  for (const std::string& field : fields) {
    EXPECT_TRUE(documented.contains(field)) << field << " is no field of the status";
  }
  const auto metrics = full_metrics();
  for (const std::string& name : named) {
    EXPECT_TRUE(metrics.contains(name)) << name << " is on the page, and no metric";
  }
  for (const auto& [name, metric] : metrics) {
    EXPECT_TRUE(named.contains(name) || name == "arbiter_up") << name << " is not on the page";
    EXPECT_FALSE(metric.samples.empty()) << name;
  }
}

TEST(Metrics, OfNamesThatNeedEscapesAreRead) {
  wire::Status status = full_status();
  const std::string name = "/a\\b\"c\nd,e}=\xC3\xA9";
  status.sources.front().name = name;
  const auto metrics = read_metrics(watch::metrics_of(status));
  EXPECT_EQ(metrics.at("arbiter_source_signals_total").samples.at({{"source", name}}), 102);
}

TEST(Metrics, OfAnEmptyStatusAndOfNoDaemonAreRead) {
  const auto metrics = read_metrics(watch::metrics_of(wire::Status()));
  EXPECT_TRUE(metrics.at("arbiter_model_info").samples.empty());
  EXPECT_TRUE(metrics.at("arbiter_model_in_force_timestamp_seconds").samples.empty());
  const auto none = read_metrics(watch::metrics_of_no_daemon());
  ASSERT_EQ(none.size(), 1u);
  EXPECT_EQ(none.at("arbiter_up").samples.at({}), 0);
}

// What the tests rest upon.
TEST(Metrics, ThatPrometheusWouldRefuseAreFound) {
  const std::string head = "# HELP a_total A.\n# TYPE a_total counter\n";
  EXPECT_NO_THROW(read_metrics(head + "a_total{b=\"c\"} 1\n"));
  for (const std::string text :
       {"", "a 1\n", "# HELP a_total A.\na_total 1\n", "# HELP a A.\n# TYPE a counter\na 1\n",
        "# HELP a_ms A.\n# TYPE a_ms gauge\na_ms 1\n"}) {
    EXPECT_NE(error_of([&] { read_metrics(text); }), "no error") << text;
  }
  for (const char* sample : {"a_total{b=\"c} 1\n", "a_total{b=\"\\c\"} 1\n", "a_total x\n",
                             "a_total{1=\"c\"} 1\n", "a_total 1\na_total 2\n", "b_total 1\n"}) {
    EXPECT_NE(error_of([&] { read_metrics(head + sample); }), "no error") << sample;
  }
}

// Debian's package would start a server, so no test may need it.
TEST(Metrics, PleasePromtoolWhereItIsInstalled) {
  if (::access("/usr/bin/promtool", X_OK) != 0) GTEST_SKIP() << "promtool is not installed";
  const auto result =
      run_program({"/usr/bin/promtool", "check", "metrics"}, watch::metrics_of(full_status()));
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
}

}  // namespace
}  // namespace arbiter::test
