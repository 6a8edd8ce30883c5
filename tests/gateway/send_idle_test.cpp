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
    accounts_[entry.dds->written] = &account;
    return sender_;
  }
  void start(const std::vector<OpenIn>&, const std::vector<OpenOut>&) override {}
  void stop() noexcept override {}
  void tend() override {
    for (const auto& [topic, count] : subscribers_) accounts_.at(topic)->set_peers(count);
  }

 private:
  const std::map<std::string, std::uint32_t> subscribers_;
  std::map<std::string, Account*> accounts_;
  KeepingSender sender_;
};

std::string said(std::map<std::string, std::uint32_t> subscribers) {
  const std::vector<Mapping> mappings = {
      read_dds("<out port='/a:i' topic='/a' type='std_msgs/msg/Bool' idle='zero'/>"
               "<out port='/b:i' topic='/b' type='std_msgs/msg/Bool' idle='zero'/>")
          .mapping};
  PeopledMiddleware middleware(std::move(subscribers));
  testing::internal::CaptureStderr();
  EXPECT_TRUE(send_idle(mappings, Kind::kDds, middleware, 0));
  return testing::internal::GetCapturedStderr();
}

TEST(SendIdle, SaysLastWhomNobodyHasHeard) {
  const std::string nobody = "nobody was there to hear it: no subscriber of DDS topic rt/";
  EXPECT_THAT(said({{"/a", 1}, {"/b", 2}}), Not(HasSubstr("nobody")));
  EXPECT_THAT(said({{"/a", 0}, {"/b", 1}}), testing::EndsWith(nobody + "a\n"));
  EXPECT_THAT(said({{"/a", 0}, {"/b", 0}}), testing::EndsWith(nobody + "b\n"));
  EXPECT_THAT(said({}), Not(HasSubstr("nobody"))) << "nothing is known of them";
}

}  // namespace
}  // namespace arbiter::gateway
