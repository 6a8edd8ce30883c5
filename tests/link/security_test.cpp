// Rule 9 of docs/hosts.md, and its recipe for DDS Security: examples/hosts/security, as it is
// installed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/link/robot.hpp"
#include "tests/support/run_program.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

// What the recipe's script makes of the rules of DDS and those of links, for hosts of these names.
class LinkKeys {
 public:
  explicit LinkKeys(const std::string& first = "head", const std::string& second = "base") {
    namespace fs = std::filesystem;
    const std::string examples = ARBITER_SOURCE "/examples";
    fs::copy(examples + "/ros2/security", rules());
    std::string permissions = content_of(examples + "/hosts/security/permissions.xml");
    for (const auto& [from, to] : {std::pair{"head", first}, {"base", second}}) {
      const std::string name = std::string("<subject_name>CN=") + from;
      permissions.replace(permissions.find(name), name.size(), "<subject_name>CN=" + to);
    }
    make(permissions, first, second);
  }
  // To publish that topic, for both hosts.
  void forbid(const std::string& topic) const {
    std::string permissions = content_of(rules() + "/permissions.xml");
    const std::string rule =
        "<deny_rule><domains><id_range><min>0</min><max>230</max></id_range></domains>"
        "<publish><topics><topic>" +
        topic + "</topic></topics></publish></deny_rule>";
    for (std::size_t at = 0; (at = permissions.find("<allow_rule>", at)) != std::string::npos;) {
      permissions.insert(at, rule);
      at += rule.size() + 1;
    }
    make(permissions, "head", "base");
  }
  [[nodiscard]] std::string path() const { return folder_.path() + "/keys"; }

 private:
  void make(const std::string& permissions, const std::string& first,
            const std::string& second) const {
    static_cast<void>(folder_.write("my_rules/permissions.xml", permissions));
    const auto made = run_program({"/bin/sh", rules() + "/make_keys", path(), first, second});
    if (made.exit_code != 0) throw std::runtime_error(made.err);
  }
  [[nodiscard]] std::string rules() const { return folder_.path() + "/my_rules"; }

  TemporaryDirectory folder_;
};

class SecuredHosts : public LoopbackHosts {
 protected:
  [[nodiscard]] std::vector<std::string> secured(const LinkKeys& keys) const {
    std::vector<std::string> arguments = network();
    arguments.insert(arguments.end(), {"--security", keys.path()});
    return arguments;
  }
  // Two hosts are there that are not of the robot's, and hear each other.
  void expect_kept_out(const std::vector<std::string>& theirs) {
    Host base("base", runtime_, motor_model("1000s"), secured(keys_));
    Host intruder("intruder", runtime_, source_model("1000s"), theirs);
    Host spy("spy", runtime_, motor_model("1000s"), theirs);
    Planner wrong(intruder);
    Body stolen(spy);
    stolen.drive(wrong);
    EXPECT_THAT(base.described(kPlanner), IsEmpty());
    Host head("head", runtime_, source_model("1000s"), secured(keys_));
    Planner right(head, kBeyond);
    Body body(base);
    EXPECT_GT(body.drive(right), kBeyond);
    EXPECT_LT(stolen.drive(wrong), kBeyond);
    base.await_described(kPlanner, "host head");
    EXPECT_THAT(base.described(kPlanner), Not(HasSubstr("intruder")));
    EXPECT_THAT(spy.described(kPlanner), Not(HasSubstr("head")));
  }

  static constexpr std::int64_t kBeyond = 1'000'000;
  const LinkKeys keys_;
};

TEST_F(SecuredHosts, WhoHasACertificateTakesPart) {
  Host head("head", runtime_, source_model("300ms"), secured(keys_));
  Host base("base", runtime_, motor_model("300ms"), secured(keys_));
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  head.link().kill();
  body.fall_back();
  head.start_link();
  body.drive(planner);
}

TEST_F(SecuredHosts, ALinkWithoutACertificateIsNotHeardAndHearsNothing) {
  expect_kept_out(network());
}

// Somebody has made keys with the same script.
TEST_F(SecuredHosts, ACertificateOfAnotherAuthorityIsNone) {
  const LinkKeys others("intruder", "spy");
  expect_kept_out(secured(others));
}

// Its camera must not leave the head; what comes after it does.
TEST_F(SecuredHosts, ATopicThatThePermissionsForbidHoldsUpNoOther) {
  keys_.forbid("arbiter/source/Camera/*");
  Host head("head", runtime_, source_model("300ms"), secured(keys_));
  Host base("base", runtime_, motor_model("300ms"), secured(keys_));
  Node eye = head.node("eye");
  const auto camera = eye.output_port<Speed>("/Camera/speed:o");
  head.see("arbiter/source/Camera/speed_3ao: Not Allowed By Security");
  Planner planner(head);
  Body body(base);
  body.drive(planner);
}

TEST_F(SecuredHosts, ALinkWithoutItsKeyWaitsForIt) {
  const std::string key = keys_.path() + "/head_key.pem";
  std::filesystem::rename(key, key + ".away");
  Host head("head", runtime_, source_model("300ms"), secured(keys_));
  head.see("trying again");
  EXPECT_THAT(head.log(), HasSubstr("head_key.pem"));
  std::filesystem::rename(key + ".away", key);
  head.see("host head, on");
}

}  // namespace
}  // namespace arbiter::test
