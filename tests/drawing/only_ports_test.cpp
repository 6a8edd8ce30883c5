#include "drawing/only_ports.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "drawing/drawing.hpp"
#include "tests/rules/model_text.hpp"

namespace arbiter::drawing {
namespace {

using rules::Folder;
using testing::ElementsAre;
using testing::HasSubstr;

// At /arm: Reach, and Stop, which has nothing there but inhibits its box. Look is at /gaze only.
const std::string kArmAndGaze = R"(<behaviors>
  <meta_behavior name="Work"><behavior>Reach</behavior><behavior>Look</behavior></meta_behavior>
  <meta_behavior name="Safety"><behavior>Stop</behavior><inhibition>Work</inhibition></meta_behavior>
  <behavior name="Reach"><config at="/arm">/reach</config><inhibition>Look</inhibition></behavior>
  <behavior name="Look"><config at="/gaze">/look</config></behavior>
  <behavior name="Stop"><config at="/base">/stop</config></behavior>
  <behavior name="Hum"><config at="/voice">/hum</config></behavior>
</behaviors>)";

rules::LoadedModel load_arm_and_gaze() {
  const Folder folder;
  rules::Diagnostics diagnostics;
  return rules::load_all(rules::read_texts({{folder.write("a.xml", kArmAndGaze)}, {}}),
                         diagnostics);
}

std::vector<std::string> names_at(const std::set<std::string>& ports) {
  std::vector<std::string> names;
  for (const auto& behaviour : only_ports(load_arm_and_gaze(), ports).model.behaviours) {
    names.push_back(behaviour.name);
  }
  return names;
}

TEST(OnlyPorts, KeepsWhoIsThereWithTheirBoxesAndWhoSilencesThem) {
  EXPECT_THAT(names_at({"/arm"}), ElementsAre("Work", "Safety", "Reach", "Stop"));
  EXPECT_THAT(names_at({"/gaze"}), ElementsAre("Work", "Safety", "Reach", "Look", "Stop"));
  EXPECT_THAT(names_at({"/base"}), ElementsAre("Safety", "Stop"));
  EXPECT_THAT(names_at({"/base", "/voice"}), ElementsAre("Safety", "Stop", "Hum"));
}

TEST(OnlyPorts, KeepsTheRulesThereAndTheSourcesThatTheyRead) {
  const auto part = only_ports(load_arm_and_gaze(), {"/arm"});
  ASSERT_EQ(part.rules.ports.size(), 1u);
  EXPECT_EQ(part.rules.ports[0].port, "/arm");
  EXPECT_THAT(part.rules.sources, ElementsAre("/reach", "/stop"));
}

TEST(OnlyPorts, CanBeDrawn) {
  const auto part = only_ports(load_arm_and_gaze(), {"/arm"});
  EXPECT_THAT(draw(part, View::kBehaviours), HasSubstr("Safety inhibits Work"));
  EXPECT_THAT(draw(part, View::kConnections), HasSubstr("/stop is sensed at /arm"));
}

}  // namespace
}  // namespace arbiter::drawing
