// What the doctor finds at the ports of a status that a test has made up.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "shm/clock.hpp"
#include "tests/watch/codes_of.hpp"
#include "watch/doctor.hpp"

namespace arbiter::test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using watch::Findings;

wire::SourceStatus wanted_source(const std::string& name) {
  wire::SourceStatus source;
  source.name = name;
  source.mentioned = true;
  return source;
}

wire::SourceStatus open_source(const std::string& name, bool mentioned) {
  wire::SourceStatus source = wanted_source(name);
  source.mentioned = mentioned;
  source.open.emplace();
  source.open->component = {"nav", 12, 1000};
  return source;
}

wire::InputStatus wanted_input(const std::string& name) {
  wire::InputStatus input;
  input.name = name;
  input.mentioned = true;
  return input;
}

wire::ConnectionStatus refused_connection(const std::string& source) {
  wire::ConnectionStatus connection;
  connection.source = source;
  connection.output = connection.input = wire::End::kOpen;
  connection.mismatch = "nav sends Pose, base takes Twist";
  return connection;
}

wire::RefusalStatus refusal(const std::string& output, std::int32_t pid) {
  return {"gateway", pid, 1000, shm::monotonic_now(), "user x may not publish " + output,
          output,    {}};
}

TEST(DoctorPorts, FindsNothingWhereAllPortsDoTheirWork) {
  wire::Status status;
  EXPECT_THAT(watch::examine_ports(status), IsEmpty());
  status.sources = {open_source("/nav:o", true), open_source("/debug:o", false)};
  status.inputs = {wanted_input("/base:i")};
  status.inputs[0].connections = {refused_connection("/nav:o")};
  status.inputs[0].connections[0].mismatch.reset();
  EXPECT_THAT(codes_of(watch::examine_ports(status)), IsEmpty());
}

TEST(DoctorPorts, FindsConnectionsThatAreRefused) {
  wire::Status status;
  status.inputs = {wanted_input("/base:i")};
  status.inputs[0].connections = {refused_connection("/nav:o")};
  status.inputs[0].cannot_deliver = {"/nav:o", "nav sends Pose, base takes Twist"};
  const Findings found = watch::examine_ports(status);
  ASSERT_THAT(codes_of(found), ElementsAre("type-mismatch")) << "one fault, one finding";
  EXPECT_THAT(found[0].what, AllOf(HasSubstr("/nav:o to /base:i"), HasSubstr("base takes Twist")));
}

TEST(DoctorPorts, FindsSelectedSourcesThatCannotDeliver) {
  wire::Status status;
  status.inputs = {wanted_input("/base:i")};
  status.inputs[0].cannot_deliver = {"/stop:o", "no component has it open"};
  const Findings found = watch::examine_ports(status);
  ASSERT_THAT(codes_of(found), ElementsAre("cannot-deliver"));
  EXPECT_EQ(found[0].what,
            "/stop:o is selected at /base:i and cannot deliver: no component has it open");
}

TEST(DoctorPorts, FindsPortsThatWereRefused) {
  wire::Status status;
  status.sources = {wanted_source("/a:o"), wanted_source("/b:o"), open_source("/c:o", true)};
  status.refusals = {refusal("/a:o", 7), refusal("/b:o", 7), refusal("/c:o", 7),
                     refusal("/unmentioned:o", 7)};
  const Findings found = watch::examine_ports(status);
  ASSERT_THAT(codes_of(found), ElementsAre("opening-refused"));
  EXPECT_THAT(found[0].what, AllOf(HasSubstr("gateway (pid 7) asked for /a:o and /b:o and was"),
                                   HasSubstr("may not publish /a:o")));
  EXPECT_EQ(found[0].mend,
            "remove the cause (for example, allow it in the policy), then start the component "
            "again");
  // Who had it open then has died: the one that was refused may have gone long before.
  status.deaths = {{"nav", 12, 1000, shm::monotonic_now(), {"/a:o", "/b:o"}, {}, {}}};
  EXPECT_THAT(watch::examine_ports(status), IsEmpty());
}

TEST(DoctorPorts, FindsNamesThatAreNearlyThoseOfTheModel) {
  wire::Status status;
  status.sources = {wanted_source("/nav/cmd:o"), open_source("/nav/cmdd:o", false)};
  const Findings found = watch::examine_ports(status);
  ASSERT_THAT(codes_of(found), ElementsAre("near-name"));
  EXPECT_THAT(found[0].what, AllOf(HasSubstr("nav (pid 12) has /nav/cmdd:o open"),
                                   HasSubstr("did you mean /nav/cmd:o, which nobody has open?")));
  status.sources[0] = open_source("/nav/cmd:o", true);
  EXPECT_THAT(watch::examine_ports(status), IsEmpty()) << "nobody is missing";
}

TEST(DoctorPorts, FindsWhatComponentsCallWrong) {
  wire::Status status;
  status.sources = {open_source("/nav/cmd:o", true), open_source("/joy/cmd:o", true)};
  status.sources[0].open->described = "DDS topic rt/nav, no publisher matched";
  status.sources[1].open->described = "DDS topic rt/joy, QoS does not match\x1b[2J";
  EXPECT_THAT(watch::examine_ports(status), IsEmpty());
  status.sources[1].open->trouble = true;
  const Findings found = watch::examine_ports(status);
  ASSERT_THAT(codes_of(found), ElementsAre("port-trouble"));
  EXPECT_EQ(found[0].what, "/joy/cmd:o comes from DDS topic rt/joy, QoS does not match\\x1b[2J");
  EXPECT_EQ(found[0].why, "nav (pid 12), which has the port open, says so");
}

TEST(DoctorPorts, ListsAFewOfEachKind) {
  wire::Status status;
  status.inputs = {wanted_input("/base:i")};
  for (int i = 0; i < 1000; ++i) {
    status.inputs[0].connections.push_back(refused_connection("/" + std::to_string(i) + ":o"));
  }
  const Findings found = watch::examine_ports(status);
  ASSERT_EQ(found.size(), 9u);
  EXPECT_THAT(found.back().what, HasSubstr("992 more connections are refused"));
}

}  // namespace
}  // namespace arbiter::test
