// The recipe of docs/dds.md for DDS Security: examples/ros2/security, as it is installed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/gateway/dds/scene.hpp"
#include "tests/support/run_program.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

const std::string kRecipe = ARBITER_DDS_SECURITY;
const std::string kConfiguration = "file://" + kRecipe + "/cyclonedds.xml,";

// Keys and signatures that the recipe's script has made. Programs that are started while it lives
// have them.
class Keys {
 public:
  Keys()
      : path_(folder_.path() + "/keys"), keys_("DDS_KEYS", path_), plugins_(kPlugins, plugins()) {
    const auto made =
        run_program({"/bin/sh", kRecipe + "/make_keys", path_, "gateway", "commander", "base"});
    if (made.exit_code != 0) throw std::runtime_error(made.err);
  }

 private:
  static constexpr const char* kPlugins = "DDS_PLUGINS";
  // Where Debian has them on a machine with this processor.
  static std::string plugins() {
    return "/usr/lib/" ARBITER_LIBRARY_ARCHITECTURE "/libddsc0debian";
  }

  TemporaryDirectory folder_;
  const std::string path_;
  ScopedVariable keys_;
  ScopedVariable plugins_;
};

Stranger named(const std::string& name, const OwnDomain& domain,
               std::vector<std::string> arguments) {
  const ScopedVariable variable("DDS_NAME", name);
  return {"cyclone", domain, std::move(arguments), kConfiguration};
}

// A base that obeys a commander through the gateway, all with certificates.
struct Secured {
  Keys keys;
  OwnDomain domain;
  Daemon daemon{base_model("1000s")};
  DdsGateway gateway{daemon, domain, kNavIn + kBaseOut + "/>", "lo",
                     "configuration=\"" + kRecipe + "/cyclonedds.xml\""};
  Stranger base = named("base", domain, {"sub", "twist", "rt/cmd_vel"});
  Stranger commander = named("commander", domain, {"pub", "twist", "rt/cmd_vel_nav"});

  void await_all() {
    base.await("matched 1");
    commander.await("matched 1");
    gateway.see("1 publisher matched");
    gateway.see("1 subscriber matched");
  }
};

bool contains(const std::vector<std::string>& lines, const std::string& line) {
  return std::find(lines.begin(), lines.end(), line) != lines.end();
}

TEST(DdsSecurity, WhoHasACertificateTakesPart) {
  Secured secured;
  secured.await_all();
  publish_until_heard(secured.commander, secured.base, "1 2");
}

// Its samples reach another one without; the gateway does not even see it.
TEST(DdsSecurity, AStrangerWithoutACertificateIsKeptOut) {
  Secured secured;
  for (const char* const vendor : {"cyclone", "fast"}) {
    Stranger witness(vendor, secured.domain, {"sub", "twist", "rt/cmd_vel_nav"});
    Stranger intruder(vendor, secured.domain, {"pub", "twist", "rt/cmd_vel_nav"});
    Stranger past_arbiter(vendor, secured.domain, {"pub", "twist", "rt/cmd_vel"});
    Stranger spy(vendor, secured.domain, {"sub", "twist", "rt/cmd_vel"});
    witness.await("matched 1");
    intruder.await("matched 1");
    past_arbiter.await("matched 1");
    spy.await("matched 1");
    if (vendor == std::string("cyclone")) secured.await_all();
    publish_until_heard(intruder, witness, "13 0");
    publish_until_heard(past_arbiter, spy, "14 0");
    publish_until_heard(secured.commander, secured.base,
                        vendor == std::string("fast") ? "2 0" : "1 0");
    // All that was sent before has come where it may.
    EXPECT_FALSE(contains(spy.lines_so_far(), "sample 1 0"));
    EXPECT_FALSE(contains(intruder.lines_so_far(), "matched 2"));
    EXPECT_FALSE(contains(past_arbiter.lines_so_far(), "matched 2"));
  }
  EXPECT_THAT(secured.gateway.log(), ::testing::Not(::testing::HasSubstr("past Arbiter")));
  EXPECT_THAT(secured.gateway.log(), ::testing::Not(::testing::HasSubstr("2 publishers")));
}

// Somebody has made keys with the same script.
TEST(DdsSecurity, ACertificateOfAnotherAuthorityIsNone) {
  Secured secured;
  const Keys others;
  Stranger witness = named("gateway", secured.domain, {"sub", "twist", "rt/cmd_vel_nav"});
  Stranger intruder = named("commander", secured.domain, {"pub", "twist", "rt/cmd_vel_nav"});
  witness.await("matched 1");
  intruder.await("matched 1");
  secured.await_all();
  publish_until_heard(intruder, witness, "13 0");
  publish_until_heard(secured.commander, secured.base, "1 0");
  EXPECT_FALSE(contains(intruder.lines_so_far(), "matched 2"));
  EXPECT_THAT(secured.gateway.log(), ::testing::Not(::testing::HasSubstr("2 publishers")));
}

// Nobody goes past Arbiter: not even who may command.
TEST(DdsSecurity, WhoMayCommandMayNotPublishWhatTheBaseObeys) {
  const Keys keys;
  const OwnDomain domain;
  Stranger commander = named("commander", domain, {"pub", "twist", "rt/cmd_vel"});
  EXPECT_EQ(commander.end(), 1);
  Stranger base = named("base", domain, {"sub", "twist", "rt/cmd_vel_nav"});
  EXPECT_EQ(base.end(), 1);
}

// The gateway says what is wrong with its keys, and goes on when it has them.
TEST(DdsSecurity, AGatewayWithoutItsKeyWaitsForIt) {
  const Keys keys;
  const std::string path = std::string(std::getenv("DDS_KEYS")) + "/gateway_key.pem";
  std::filesystem::rename(path, path + ".away");
  const OwnDomain domain;
  Daemon daemon(base_model("1000s"));
  DdsGateway gateway(daemon, domain, kNavIn, "lo",
                     "configuration=\"" + kRecipe + "/cyclonedds.xml\"");
  gateway.see("trying again");
  EXPECT_THAT(gateway.log(), ::testing::HasSubstr("gateway_key.pem"));
  std::filesystem::rename(path + ".away", path);
  await_described(daemon, "/Nav/cmd_vel:o", "no publisher matched");
  EXPECT_EQ(gateway.end(), 0);
}

}  // namespace
}  // namespace arbiter::test
