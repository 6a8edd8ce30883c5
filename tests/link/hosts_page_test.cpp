// docs/hosts-document.md against documents of real links.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/link/robot.hpp"
#include "tests/support/documented_fields.hpp"
#include "wire/link_call.hpp"

namespace arbiter::test {
namespace {

using nlohmann::json;

// Until it is so, of this instance.
json await_document(const std::string& instance, const std::function<bool(const json&)>& is_so) {
  for (;;) {
    try {
      json document = json::parse(wire::LinkCall(instance).ask({"", "hosts", {}}));
      if (is_so(document)) return document;
    } catch (const wire::CallError&) {  // the link has just been started
    }
    ::poll(nullptr, 0, 5);
  }
}

bool has_kind(const json& document, const std::string& kind) {
  return std::ranges::any_of(document["disagreements"],
                             [&](const json& each) { return each["kind"] == kind; });
}

TEST(HostsPage, NamesEachFieldOfTheDocument) {
  const OwnDomain domain;
  const TemporaryDirectory runtime;
  const std::vector<std::string> network{"--domain", std::to_string(domain.number())};
  ObservedFields observed;
  Host lonely("lonely", runtime, motor_model("1000s"), {"--interface", "no-such"});
  observed.see(
      await_document("lonely", [](const json& now) { return now["waits_for"].is_string(); }));
  Host head("head", runtime, motor_model("1000s"), network);
  Host base("base", runtime, motor_model("900s"), network);
  Host bare("bare", runtime, "", network);
  // Another machine of the same name.
  Daemon::Options options;
  options.instance = "twin";
  options.runtime_directory = runtime.path();
  Daemon twin(kNoRules, options);
  ChildProcess link({std::string(ARBITER_PROGRAMS) + "/arbiter-link", "--instance", "twin",
                     "--host", "bare", network.at(0), network.at(1)},
                    {}, {});
  {
    Planner planner(head);
    Planner other(base);
    Body body(base);
    Node same = head.node("same");
    auto motor = same.input_port<Speed>(kMotor);
    observed.see(await_document("base", [](const json& now) {
      return has_kind(now, "input port") && has_kind(now, "source") && has_kind(now, "models") &&
             has_kind(now, "host name") && now["hosts"][1]["round_trip_ns"].is_number();
    }));
  }
  Planner planner(head);
  observed.see(await_document("base", [](const json& now) {
    return !now["imports"].empty() && now["imports"][0]["open"] == true;
  }));
  link.signal(SIGTERM);
  EXPECT_EQ(link.wait(), 0);
  EXPECT_THAT(
      disagreements(content_of(std::string(ARBITER_SOURCE) + "/docs/hosts-document.md"), observed),
      testing::IsEmpty());
}

}  // namespace
}  // namespace arbiter::test
