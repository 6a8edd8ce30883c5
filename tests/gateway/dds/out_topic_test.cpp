// Which samples the thread that receives them may send.
#include "gateway/dds/out_topic.hpp"

#include <gtest/gtest.h>

#include "tests/gateway/mapping_text.hpp"

namespace arbiter::gateway::dds {
namespace {

TEST(OutTopic, TakesSamplesOf64KiBAndTheirHeaderAtOnceAndNoLargerOnes) {
  const Read read = read_dds("<out port='/Base/cmd:i' topic='/cmd' type='a/msg/B'/>");
  Account account(read.entry().outside(), "subscriber");
  const Bell bell;
  const OutTopic topic(read.entry(), account, bell);
  const Sender& sender = topic;
  EXPECT_EQ(sender.largest_at_once(), 4u + 65'536u);
}

}  // namespace
}  // namespace arbiter::gateway::dds
