// Who else is at a topic of iceoryx: whoever publishes past the gateway, or subscribes in vain.
#include <gmock/gmock.h>

#include <csignal>
#include <optional>
#include <string>

#include "tests/gateway/iceoryx/scene.hpp"

namespace arbiter::test {
namespace {

// It is past all arbitration.
TEST_F(Iceoryx, WhoElsePublishesWhereTheGatewayDoesIsTold) {
  const Roudi roudi(directory_);
  Spoken gate = gateway(directory_, out("/Base:i", "base"));
  wait_until([&] { return !described_input("/Base:i").empty(); });
  std::optional<Spoken> stranger = plain_publisher("base");
  const std::string name = "plain-publisher-" + std::to_string(stranger->process.pid());
  ASSERT_TRUE(gate.hear("iceoryx Test/One/base: others publish there too, past all arbitration: " +
                        name + "; let them publish to another topic, and map that one with <in>"));
  wait_until([&] { return described_input("/Base:i").find(name) != std::string::npos; });
  stranger->process.signal(SIGTERM);
  wait_until([&] { return described_input("/Base:i").find(name) == std::string::npos; });
}

// The second one has no port: it says nothing of the first, nor of others, until it serves the
// topic.
TEST_F(Iceoryx, OfTwoGatewaysTheOneThatServesATopicSaysWhoElseHasIt) {
  const Roudi roudi(directory_);
  Spoken first = gateway(directory_, out("/Base:i", "base"));
  ASSERT_TRUE(first.hear("serves 0 topics in, 1 out"));
  Spoken second = gateway(directory_, out("/Base:i", "base"));
  ASSERT_TRUE(second.hear("/Base:i is not served"));
  ASSERT_TRUE(first.hear("another gateway has this topic: pid "));
  const Spoken stranger = plain_publisher("base");
  ASSERT_TRUE(first.hear("others publish there too"));
  first.process.signal(SIGTERM);
  ASSERT_TRUE(second.hear("/Base:i is served now"));
  const std::size_t before = second.heard.size();
  ASSERT_TRUE(second.hear("others publish there too"));
  EXPECT_THAT(second.heard.substr(0, before),
              testing::Not(testing::HasSubstr("others publish there too")));
  EXPECT_THAT(second.heard, testing::Not(testing::HasSubstr("another gateway")));
}

// RouDi tells nobody.
TEST_F(Iceoryx, ASubscriberThatAsksForWhatTheGatewayDoesNotOfferIsNamed) {
  const Roudi roudi(directory_);
  Spoken gate = gateway(directory_, out("/Base:i", "base"));
  Spoken subscriber({ARBITER_TESTS "/plain_iceoryx_subscriber", "Test", "One", "base", "blocking"});
  const std::string name = "plain-subscriber-" + std::to_string(subscriber.process.pid());
  wait_until([&] {
    return described_input("/Base:i").find("no subscriber matched; " + name +
                                           " subscribes and is not connected: it asks for ") !=
           std::string::npos;
  });
  subscriber.process.signal(SIGTERM);
  wait_until([&] { return described_input("/Base:i").find(name) == std::string::npos; });
}

// What is sent all the time, and each time in vain, says nothing in its place.
TEST_F(Iceoryx, ASubscriberThatIsRefusedIsNamedBesideMemoryThatIsMissing) {
  const Roudi roudi(directory_, Roudi::kLittle);
  Spoken gate = gateway(directory_, out("/Base:i", "base", "size='4096' idle='zero'"));
  const Spoken subscriber(
      {ARBITER_TESTS "/plain_iceoryx_subscriber", "Test", "One", "base", "blocking"});
  const std::string name = "plain-subscriber-" + std::to_string(subscriber.process.pid());
  wait_until([&] {
    const std::string text = described_input("/Base:i");
    return text.find(name + " subscribes and is not connected") != std::string::npos &&
           text.find("no memory pool for chunks of 4096 bytes") != std::string::npos;
  });
}

}  // namespace
}  // namespace arbiter::test
