// What is sent for a gateway that has died, and what is said of it: whether anybody has heard it.
#include "gateway/core/send_idle.hpp"

#include <gmock/gmock.h>

#include <map>
#include <string>

#include "tests/gateway/foreign.hpp"
#include "tests/gateway/mapping_text.hpp"

namespace arbiter::gateway {
namespace {

using testing::HasSubstr;
using testing::Not;

// Topics whose subscribers are there, or not, from the first look on.
class PeopledMiddleware : public Middleware {
 public:
  // By topic.
  explicit PeopledMiddleware(std::map<std::string, std::uint32_t> subscribers)
      : subscribers_(std::move(subscribers)) {}

  Sender& sender(const Gateway&, const Entry& entry, Account& account) override {
    accounts_[entry.dds.value().written] = &account;
    return sender_of_all;
  }
  void start(const std::vector<OpenIn>&, const std::vector<OpenOut>&) override {}
  void stop() noexcept override {}
  void tend() override {
    for (const auto& [topic, count] : subscribers_) accounts_.at(topic)->set_peers(count);
    if (joins_at != 0 && --joins_at == 0) sender_of_all.answer = Sender::Result::kSent;
  }
  [[nodiscard]] bool is_joining() const override { return joins_at != 0; }

  KeepingSender sender_of_all;
  int joins_at = 0;  // a tend()

 private:
  const std::map<std::string, std::uint32_t> subscribers_;
  std::map<std::string, Account*> accounts_;
};

const std::vector<Mapping>& two_topics() {
  static const std::vector<Mapping> mappings = {
      read_dds("<out port='/a:i' topic='/a' type='std_msgs/msg/Bool' idle='zero'/>"
               "<out port='/b:i' topic='/b' type='std_msgs/msg/Bool' idle='zero'/>")
          .mapping,
      read_iceoryx("<out service='a' instance='b' event='c' port='/c:i' size='4' idle='zero'/>")
          .mapping};
  return mappings;
}

std::string said(std::map<std::string, std::uint32_t> subscribers) {
  PeopledMiddleware middleware(std::move(subscribers));
  testing::internal::CaptureStderr();
  EXPECT_TRUE(send_idle(two_topics(), Kind::kDds, middleware, 0));
  return testing::internal::GetCapturedStderr();
}

TEST(SendIdle, SaysLastWhomNobodyHasHeard) {
  const std::string nobody = "nobody was there to hear it: no subscriber of DDS topic rt/";
  EXPECT_THAT(said({{"/a", 1}, {"/b", 2}}), Not(HasSubstr("nobody")));
  EXPECT_THAT(said({{"/a", 0}, {"/b", 1}}), testing::EndsWith(nobody + "a\n"));
  EXPECT_THAT(said({{"/a", 0}, {"/b", 0}}), testing::EndsWith(nobody + "b\n"));
  EXPECT_THAT(said({}), Not(HasSubstr("nobody"))) << "nothing is known of them";
}

TEST(SendIdle, FailsIfOneOfThemCouldNotBeSent) {
  using Result = Sender::Result;
  const auto is_sent = [](Result one, Result other) {
    PeopledMiddleware middleware({});
    middleware.sender_of_all.answers = {one, other};
    return send_idle(two_topics(), Kind::kDds, middleware, 0);
  };
  EXPECT_TRUE(is_sent(Result::kSent, Result::kSent));
  EXPECT_FALSE(is_sent(Result::kSent, Result::kRefused));
  EXPECT_FALSE(is_sent(Result::kRefused, Result::kSent));
}

// A name server may be silent for as long.
TEST(SendIdle, TakesItsTimeOnceWhatTakesLongToJoinIsJoined) {
  PeopledMiddleware middleware({});
  middleware.sender_of_all.answer = Sender::Result::kNotReady;
  middleware.joins_at = 50;
  EXPECT_TRUE(send_idle(two_topics(), Kind::kDds, middleware, 500'000'000));
}

}  // namespace
}  // namespace arbiter::gateway
