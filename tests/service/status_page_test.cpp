// docs/status.md against status documents of real daemons, field by field and in both directions.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/documented_fields.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::IsEmpty;

std::string status_page() { return content_of(std::string(ARBITER_SOURCE) + "/docs/status.md"); }

// A change that a client asks for, until it is in force.
void change(const Daemon& daemon, wire::MessageKind kind, const std::string& name = {}) {
  RawClient client(daemon.instance());
  client.hello("operator");
  client.send(RawClient::message(kind, name));
  client.expect(wire::MessageKind::kDone);
}

// Two models, an application, and each way in which a model comes into force.
void see_models(ObservedFields& observed) {
  const TemporaryDirectory files;
  const auto only = [](const std::string& source) {
    return rules(arbiter_at("/in", select(source)));
  };
  Daemon daemon(only("/a"),
                {.application = application(connection("/a", "/in") + connection("/b", "/in")),
                 .arguments = {"--model", "other=" + files.write("b.xml", only("/b"))}});
  daemon.load(only("/b"));
  change(daemon, wire::MessageKind::kSwitch, "other");
  change(daemon, wire::MessageKind::kRollback);
  observed.see(daemon.status());
  // One that knows the model that is in force, and not its files.
  Node node("test");
  auto out = node.output_port<Number>("/a");
  daemon.kill();
  daemon.restart();
  observed.see(daemon.status());
  // One that knows no more of it, because its own files are refused.
  daemon.kill();
  daemon.write_model("<behaviors>");
  daemon.restart();
  observed.see(daemon.status());
}

void see_no_model(ObservedFields& observed) {
  Daemon daemon("", {.without_model = true});
  observed.see(daemon.status());
}

// Each pair of an output port and an input port that are open, away and closed; a pair whose types
// differ; a source that is read only.
void see_ports(ObservedFields& observed) {
  const std::string selects = select("/here", "not /stop") + select("/away") + select("/closed");
  const auto first = [](const std::string& port, const std::string& body) {
    return R"(<arbiter at=")" + port + R"(" conflict="first">)" + body + "</arbiter>";
  };
  Daemon daemon("<behaviors timeout='forever'><source port='/closed' timeout='1s'/>" +
                first("/in-here", selects) + first("/in-away", selects) +
                first("/in-closed", selects) + arbiter_at("/in-typed", select("/typed")) +
                "</behaviors>");
  Component stopped("stopped");
  ASSERT_EQ(stopped.tell("output /away"), "open");
  ASSERT_EQ(stopped.tell("input /in-away 4 1 0"), "open");
  Node node("here");
  auto here = node.output_port("/here");
  auto typed = node.output_port<double>("/typed");
  auto in_here = node.input_port("/in-here", {.when_full = refuse_new});
  auto in_typed = node.input_port<int>("/in-typed");
  auto tap = node.tap("/here");
  here.describe_trouble("a topic");
  in_here.describe_trouble("a topic");
  daemon.kill();
  stopped.process().stop();
  daemon.restart();
  while (daemon.connection("/here", "/in-here")["state"] != "connected" ||
         daemon.source("/here")["taps"].empty() || !daemon.source("/here").contains("described") ||
         !daemon.input("/in-here").contains("described")) {
  }
  here.signal();
  typed.publish(1.0);
  observed.see(daemon.status());
}

void see_strangers(ObservedFields& observed) {
  Daemon daemon(single_model());
  Component arm("arm");
  ASSERT_EQ(arm.tell("input /in 8 1 0"), "open");
  ASSERT_EQ(arm.tell("output /out"), "open");
  daemon.kill();
  daemon.lose_state();
  daemon.restart();
  const auto has_said_all = [](const json& status) {
    return !status["strangers"].empty() && !status["strangers"][0]["inputs"].empty() &&
           !status["strangers"][0]["outputs"].empty();
  };
  json status = daemon.status();
  while (!has_said_all(status)) status = daemon.status();
  observed.see(status);
}

void see_deaths(ObservedFields& observed) {
  Daemon daemon(single_model());
  Component arm("arm");
  ASSERT_EQ(arm.tell("input /in 8 1 0"), "open");
  ASSERT_EQ(arm.tell("output /out"), "open");
  arm.kill();
  json status = daemon.status();
  while (status["deaths"].empty()) status = daemon.status();
  EXPECT_EQ(status["deaths"][0]["outputs"], json::array({"/out"}));
  EXPECT_EQ(status["deaths"][0]["inputs"], json::array({"/in"}));
  Component again("arm");
  ASSERT_EQ(again.tell("output /out"), "open");
  status = daemon.status();
  EXPECT_EQ(status["deaths"][0]["opened_since"], json::array({"/out"}));
  observed.see(status);
}

void see_refusals(ObservedFields& observed) {
  const TemporaryDirectory files;
  Daemon daemon(
      single_model(),
      {.arguments = {
           "--policy",
           files.write("policy", "deny everyone output,input *\nallow everyone observe\n")}});
  Component arm("arm");
  EXPECT_THAT(arm.tell("input /in 8 1 0"), HasSubstr("may not open"));
  EXPECT_THAT(arm.tell("output /out"), HasSubstr("may not open"));
  const json status = daemon.status();
  EXPECT_EQ(status["refusals"][0]["output"], "/out");
  EXPECT_EQ(status["refusals"][1]["input"], "/in");
  observed.see(status);
}

TEST(StatusPage, NamesEachFieldOfTheDocumentAndNoOther) {
  ObservedFields observed;
  see_models(observed);
  see_no_model(observed);
  see_ports(observed);
  see_strangers(observed);
  see_deaths(observed);
  see_refusals(observed);
  EXPECT_THAT(disagreements(status_page(), observed), IsEmpty());
}

TEST(StatusPage, HasAnExampleThatCouldBeOne) {
  const auto example = listing_of(status_page(), "json");
  ASSERT_TRUE(example);
  EXPECT_THAT(faults_of_example(status_page(), json::parse(*example)), IsEmpty());
}

// The comparison itself: a page of two objects, and documents that differ from it.

const std::string kPage =
    "# A page\n\n"
    "| field | type | there | what it says |\n"
    "| --- | --- | --- | --- |\n"
    "| `name` | string or null | always | its name |\n"
    "| `parts` | array of objects | always | its parts |\n"
    "\n## `parts[]`: parts\n\n"
    "| field | type | there | what it says |\n"
    "| --- | --- | --- | --- |\n"
    "| `state` | string | always | one of: `new`, `number N`. Which `state` that is |\n"
    "| `size` | integer | when new | in bytes |\n";

std::vector<json> documents() {
  return {json::parse(R"({"name": null, "parts": []})"),
          json::parse(R"({"name": "a", "parts": [{"state": "new", "size": 1}]})"),
          json::parse(R"({"name": "a", "parts": [{"state": "number 42"}]})")};
}

std::vector<std::string> compare(const std::vector<json>& documents) {
  ObservedFields observed;
  for (const json& each : documents) observed.see(each);
  return disagreements(kPage, observed);
}

TEST(DocumentedFields, AgreeWithDocumentsThatHaveAllOfThem) {
  EXPECT_THAT(compare(documents()), IsEmpty());
}

TEST(DocumentedFields, LackWhatADocumentHasBesides) {
  auto seen = documents();
  seen[1]["parts"][0]["colour"] = "red";
  seen[2]["parts"][0]["colour"] = "red";
  EXPECT_THAT(compare(seen), testing::ElementsAre("parts[].colour is not on the page"));
}

TEST(DocumentedFields, AreTooManyWhereNoDocumentHasOne) {
  auto seen = documents();
  for (auto& each : seen) each.erase("name");
  EXPECT_THAT(compare(seen), testing::ElementsAre("name (line 5) is in no document"));
}

TEST(DocumentedFields, AreOfOtherTypes) {
  auto seen = documents();
  seen[0]["name"] = "b";
  EXPECT_THAT(compare(seen), testing::ElementsAre("name (line 5) is {null, string} on the page and "
                                                  "{string} in documents"));
}

TEST(DocumentedFields, AreThereAtOtherTimes) {
  auto seen = documents();
  seen[2]["parts"][0]["size"] = 1;
  seen[2].erase("name");
  EXPECT_THAT(compare(seen), testing::ElementsAre("name (line 5) is not always there",
                                                  "parts[].size (line 13) is always there"));
}

TEST(DocumentedFields, HaveOtherValues) {
  auto seen = documents();
  seen[1]["parts"][0]["state"] = "old";
  EXPECT_THAT(compare(seen),
              testing::ElementsAre("parts[].state (line 12) is one of {new, number N} on the page "
                                   "and one of {number N, old} in documents"));
}

TEST(DocumentedFields, AreMissingInAnExample) {
  EXPECT_THAT(faults_of_example(kPage, json::parse(R"({"name": 1, "part": []})")),
              testing::ElementsAre("name has another type than the page says",
                                   "part is not on the page", "parts is missing"));
}

}  // namespace
}  // namespace arbiter::test
