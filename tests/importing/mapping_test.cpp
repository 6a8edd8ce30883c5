// What gateways read of an import: the mapping, beside the model.
#include <gtest/gtest.h>

#include <set>

#include "gateway/mapping/check_mapping.hpp"
#include "gateway/mapping/read_mapping.hpp"
#include "tests/importing/imported.hpp"

namespace arbiter::test {
namespace {

void expect_fit(const Imported& imported) {
  ASSERT_TRUE(imported.plan) << testing::PrintToString(imported.findings());
  const auto& plan = *imported.plan;
  rules::Diagnostics diagnostics;
  const auto rules = rules::load(
      rules::ModelTexts{{{"model.xml", importing::write_model(plan)}}, {}}, diagnostics);
  const rules::TextFile text("mapping.xml", importing::write_mapping(plan, "model.xml"));
  const auto mapping = gateway::read_mapping(text, diagnostics);
  gateway::check_mappings({mapping}, &rules, diagnostics);
  for (const auto& item : diagnostics.items()) {
    EXPECT_NE(item.severity, rules::Severity::kError) << item.message << "\n" << text.content();
  }
  ASSERT_EQ(mapping.gateways.size(), 1u);
  std::set<std::string> ports;
  for (const auto& entry : mapping.gateways.front().entries) {
    for (const auto* port : entry.ports()) ports.insert(port->name);
  }
  for (const std::string& source : rules.sources) EXPECT_TRUE(ports.contains(source)) << source;
  EXPECT_TRUE(ports.contains(plan.output_port));
  EXPECT_EQ(mapping.gateways.front().entries.size(), plan.commands.size() + plan.locks.size() + 1);
}

TEST(ImportedMapping, IsWhatAGatewayReadsBesideTheModel) {
  const std::string topics =
      "topics:\n- {name: nav, topic: nav_vel, timeout: 0.5, priority: 10}\n"
      "- {name: '<&\">', topic: joy_vel, timeout: 0.0, priority: 9}\n";
  const std::string locks =
      "locks:\n- {name: stop, topic: e_stop, timeout: 0.3, priority: 255}\n"
      "- {name: nav, topic: pause, timeout: 0.0, priority: 100}\n";
  expect_fit(import_texts(Program::kTwistMux, {topics + locks}));
  expect_fit(import_texts(Program::kTwistMux, {topics}));
  importing::ImportOptions options;
  options.type = importing::kTwistStamped;
  options.output_topic = "/cmd_vel";
  options.domain = 42;
  expect_fit(import_texts(Program::kTwistMux, {topics, locks}, options));
  expect_fit(import_texts(Program::kCmdVelMux,
                          {"subscribers:\n- {name: a, topic: a, timeout: 0.5, priority: 1}\n"}));
}

}  // namespace
}  // namespace arbiter::test
