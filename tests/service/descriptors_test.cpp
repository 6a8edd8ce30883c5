// A daemon that has no descriptor left.
#include <gtest/gtest.h>
#include <sys/syscall.h>

#include <string>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/client/models.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/raw_client.hpp"
#include "tests/support/threads.hpp"

namespace arbiter::test {
namespace {

TEST(Descriptors, WhenTheyRunOutClientsAreTurnedAwayAndTheDaemonRests) {
  Daemon daemon(single_model(), {.max_descriptors = 64});
  Node node("test");
  {
    std::vector<RawClient> many;
    for (int i = 0; i < 80; ++i) many.emplace_back(daemon.instance());
    wire::Received received;
    EXPECT_FALSE(many.back().receive(received)) << "turned away";
    wait_until_it_sleeps_in(SYS_epoll_wait, daemon.process().pid(), daemon.process().pid());
  }
  Node other("other");
  auto out = other.output_port<int>("/out");
  auto in = node.input_port<int>("/in");
  EXPECT_EQ(out.publish(1).delivered, 1u);
}

TEST(Descriptors, WhenTheyRunOutPortsAreRefusedAndWhoIsConnectedStays) {
  Daemon daemon(kNoRules, {.max_descriptors = 128});
  Node node("test");
  std::vector<OutputPort<int>> ports;
  std::string why;
  while (why.empty() && ports.size() < 64) {
    try {
      ports.push_back(node.output_port<int>("/" + std::to_string(ports.size())));
    } catch (const Error& error) {
      why = error.what();
    }
  }
  EXPECT_NE(why.find("limit-exceeded: user"), std::string::npos) << why;
  EXPECT_NE(why.find("RLIMIT_NOFILE"), std::string::npos) << why;
  const std::size_t most = ports.size();
  EXPECT_GT(most, 4u);
  for (const char* gone : {" left, ", " left\n"}) {
    EXPECT_EQ(daemon.log().find(gone), std::string::npos) << "nobody was dropped";
  }
  const std::size_t used = daemon.open_descriptors();
  ports.pop_back();
  await([&] { return daemon.open_descriptors() < used; });  // a thread closes what it was
  ports.push_back(node.output_port<int>("/" + std::to_string(most - 1)));
}

}  // namespace
}  // namespace arbiter::test
