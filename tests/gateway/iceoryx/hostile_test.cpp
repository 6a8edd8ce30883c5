// A participant of iceoryx that is hostile: it may write the headers of its chunks, which lie in
// memory that it shares with those who receive them. Only counts may come of it.
#include <gmock/gmock.h>

#include <string>

#include "tests/gateway/iceoryx/scene.hpp"

namespace arbiter::test {
namespace {

Spoken hostile_publisher(const std::string& event, int header = 0) {
  Spoken publisher(
      {ARBITER_TESTS "/hostile_iceoryx_publisher", "Test", "One", event, std::to_string(header)});
  EXPECT_TRUE(publisher.hear("ready")) << publisher.heard;
  return publisher;
}

// What is written into a header that has no user header, and what the gateway says of it.
struct Lie {
  const char* written;
  const char* told;
};
constexpr const char* kOutside = "does not lead to a payload in its memory segment";

class HostileHeader : public Iceoryx, public testing::WithParamInterface<Lie> {};
INSTANTIATE_TEST_SUITE_P(
    Lies, HostileHeader,
    testing::Values(Lie{"offset=4294967040", kOutside}, Lie{"offset=0", kOutside},
                    Lie{"offset=39", kOutside}, Lie{"size=4294967295", kOutside},
                    Lie{"size=60000 offset=17200000", kOutside},
                    Lie{"header=4294967295", "user header of 4294967295 bytes"},
                    Lie{"header=12 id=0", "user header of 12 bytes"},
                    Lie{"version=2", "another version"}));

// More chunks than an end of iceoryx may have at once: none of them is kept. In a round there are
// no more than its queue holds.
TEST_P(HostileHeader, IsCountedAndOthersOfTheTopicArriveAllTheSame) {
  constexpr int kRounds = 50;
  constexpr int kLies = 7;
  const Roudi roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o"));
  Spoken hostile = hostile_publisher("low");
  Spoken honest = plain_publisher("low");
  wait_for_description("/Low:o", "2 publishers matched");
  const pid_t worker = worker_of("/Low:o");
  for (int round = 1; round <= kRounds; ++round) {
    for (int i = 0; i < kLies; ++i) hostile.say(std::string("x ") + GetParam().written);
    for (int i = 0; i < kLies; ++i) ASSERT_TRUE(hostile.hear("published"));
    honest.say("x");
    wait_until([&] { return daemon_.source("/Low:o")["published"] == round; });
  }
  wait_for_description("/Low:o", std::to_string(kRounds * kLies) + " unreadable");
  wait_for_description("/Low:o", GetParam().told);
  EXPECT_EQ(worker_of("/Low:o"), worker);
}

// A header of the size that the mapping says, of which iceoryx says that there is none.
TEST_F(Iceoryx, AUserHeaderThatIsDeniedIsReadWhereItStands) {
  const Roudi roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o", "user_header='12'") +
                                        out("/Base:i", "base", "user_header='12'"));
  Spoken hostile = hostile_publisher("low", 12);
  Spoken subscriber = plain_subscriber("base");
  ASSERT_TRUE(subscriber.hear("ready"));
  wait_for_description("/Low:o", "1 publisher matched");
  const pid_t worker = worker_of("/Low:o");
  hostile.say("x id=0");
  EXPECT_EQ(subscriber.line(), "hhhhhhhhhhhh|x");
  EXPECT_EQ(worker_of("/Low:o"), worker);
}

}  // namespace
}  // namespace arbiter::test
