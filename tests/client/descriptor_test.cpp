// fd(): an input port in a loop of one's own.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/epoll.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/readable.hpp"

namespace arbiter::test {
namespace {

using namespace std::chrono_literals;

void wait_until_readable(int fd) {
  pollfd polled{fd, POLLIN, 0};
  while (::poll(&polled, 1, -1) != 1) {
  }
}

TEST(Descriptor, BecomesReadableWhenASampleComes) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  const int fd = in.fd();
  EXPECT_EQ(in.fd(), fd);
  EXPECT_FALSE(in.take());
  EXPECT_FALSE(is_readable(fd));
  out.publish(Number{1});
  EXPECT_TRUE(is_readable(fd));
  EXPECT_EQ(take_from(in), 1);
  EXPECT_FALSE(in.take());
  EXPECT_FALSE(is_readable(fd));
}

TEST(Descriptor, IsReadableWhereASampleWaitedBeforeItWasAskedFor) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  out.publish(Number{1});
  EXPECT_TRUE(is_readable(in.fd()));
}

TEST(Descriptor, StaysReadableUntilEverythingIsTaken) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  const int fd = in.fd();
  EXPECT_FALSE(in.take());
  for (int i = 0; i < 5; ++i) out.publish(Number{i});
  for (int i = 0; i < 5; ++i) {
    EXPECT_TRUE(is_readable(fd));
    EXPECT_TRUE(in.take());
  }
  EXPECT_FALSE(in.take());
  EXPECT_FALSE(is_readable(fd));
}

TEST(Descriptor, BecomesReadableWhenThePortBecomesIdle) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto stop = node.output_port<Number>("/stop");
  auto in = node.input_port<Number>("/in");
  const int fd = in.fd();
  low.publish(Number{1});
  EXPECT_TRUE(in.take());
  EXPECT_FALSE(in.take());
  EXPECT_FALSE(is_readable(fd));
  stop.signal();
  EXPECT_TRUE(is_readable(fd));
  EXPECT_FALSE(in.take());
  EXPECT_TRUE(in.idle());
  EXPECT_FALSE(is_readable(fd));
}

TEST(Descriptor, BecomesReadableWhenActivityRunsOut) {
  Daemon daemon(single_model("20ms"));
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  const int fd = in.fd();
  for (int i = 0; i < 3; ++i) {
    out.publish(Number{i});
    wait_until_readable(fd);
    EXPECT_TRUE(in.take());
    while (!in.idle()) {
      EXPECT_FALSE(in.take());
      if (!in.idle()) wait_until_readable(fd);
    }
    EXPECT_FALSE(in.take());
    EXPECT_FALSE(is_readable(fd));
  }
}

// For whoever takes what he publishes himself.
TEST(Descriptor, IsNotMadeReadableWhileItIsDisarmed) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  in.disarm();  // nothing: there is none
  const int fd = in.fd();
  EXPECT_FALSE(in.take());
  for (int i = 0; i < 3; ++i) {
    in.disarm();
    in.disarm();
    out.publish(Number{i});
    EXPECT_FALSE(is_readable(fd));
    EXPECT_EQ(take_from(in), i);
    EXPECT_FALSE(in.take());
    EXPECT_FALSE(is_readable(fd));
  }
  out.publish(Number{3});
  EXPECT_TRUE(is_readable(fd)) << "taking to the end has armed it again";
}

// What has come before is not forgotten.
TEST(Descriptor, StaysReadableWhereItIsDisarmedThen) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  const int fd = in.fd();
  EXPECT_FALSE(in.take());
  out.publish(Number{1});
  in.disarm();
  EXPECT_TRUE(is_readable(fd));
}

// A port that believes low, and is armed again and again for the samples of low.
class DescriptorOfLow : public testing::Test {
 protected:
  DescriptorOfLow() {
    EXPECT_FALSE(in.take());
    for (int i = 0; i < 3; ++i) {
      in.disarm();
      low.publish(Number{i});
      EXPECT_EQ(take_from(in), i);
      EXPECT_FALSE(in.take());
    }
    EXPECT_FALSE(is_readable(fd));
  }

  Daemon daemon{override_model()};
  Node node{"test"};
  OutputPort<Number> low = node.output_port<Number>("/low");
  OutputPort<Number> stop = node.output_port<Number>("/stop");
  InputPort<Number> in = node.input_port<Number>("/in");
  const int fd = in.fd();
};

TEST_F(DescriptorOfLow, BecomesReadableForTheNextSample) {
  low.publish(Number{3});
  EXPECT_TRUE(is_readable(fd));
}

TEST_F(DescriptorOfLow, BecomesReadableAtAnOverride) {
  stop.signal();
  EXPECT_TRUE(is_readable(fd));
}

TEST_F(DescriptorOfLow, BecomesReadableAtItsEnd) {
  low.deactivate();
  EXPECT_TRUE(is_readable(fd));
}

// While it is disarmed nobody rings: what is so then is found where it is armed again.
TEST_F(DescriptorOfLow, IsArmedForAnOverrideThatCameBefore) {
  in.disarm();
  low.publish(Number{3});
  stop.signal();
  EXPECT_FALSE(in.take());
  EXPECT_FALSE(is_readable(fd));
  EXPECT_TRUE(in.idle());
  stop.deactivate();
  EXPECT_TRUE(is_readable(fd)) << "low commands again";
}

TEST_F(DescriptorOfLow, IsArmedForAnEndThatCameBefore) {
  in.disarm();
  low.publish(Number{3});
  EXPECT_EQ(take_from(in), 3);
  low.deactivate();
  EXPECT_FALSE(in.take());
  EXPECT_FALSE(is_readable(fd));
  EXPECT_TRUE(in.idle());
  low.signal();
  EXPECT_TRUE(is_readable(fd)) << "low commands again";
}

// It may be asked in two ways by turns.
TEST_F(DescriptorOfLow, TellsOfIdlenessAgainWhereThePortWasCommandedBySignals) {
  for (int i = 0; i < 3; ++i) {
    low.deactivate();
    EXPECT_EQ(in.wait_for(0s).status(), WaitStatus::idle);
    low.signal();
    EXPECT_FALSE(in.take());
  }
}

// The time at which activity runs out moves away with each sample, and comes all the same.
TEST(Descriptor, BecomesReadableWhenActivityRunsOutThatWasRenewed) {
  Daemon daemon(single_model("50ms"));
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  const int fd = in.fd();
  for (int i = 0; i < 100; ++i) {
    out.publish(Number{i});
    while (in.take()) {
    }
  }
  while (!in.idle()) {
    wait_until_readable(fd);
    EXPECT_FALSE(in.take());
  }
  EXPECT_FALSE(in.take());
  EXPECT_FALSE(is_readable(fd));
}

TEST(Descriptor, WorksBesideWaitFor) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  const int fd = in.fd();
  for (int i = 0; i < 3; ++i) {
    out.publish(Number{i});
    EXPECT_TRUE(in.wait_for(std::chrono::hours::max()));
    EXPECT_TRUE(in.wait_for(std::chrono::nanoseconds(1)).timed_out());
    EXPECT_TRUE(is_readable(fd)) << "so that its loop arms it again";
    EXPECT_FALSE(in.take());
    EXPECT_FALSE(is_readable(fd));
  }
}

// Edge-triggered, which forgives no lost wake-up: a sample that came while the descriptor was being
// armed must ring again, or be found.
TEST(Descriptor, LosesNoWakeUpHoweverTheTwoMeet) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in", {.depth = 4, .when_full = refuse_new});
  constexpr std::int64_t kSamples = 30000;
  const shm::FileDescriptor loop(epoll_create1(EPOLL_CLOEXEC));
  epoll_event event{};
  event.events = EPOLLIN;
  ASSERT_EQ(epoll_ctl(loop.get(), EPOLL_CTL_ADD, in.fd(), &event), 0);
  std::thread sender([&] {
    for (std::int64_t i = 0; i < kSamples;) i += out.publish(Number{i}).delivered;
  });
  for (std::int64_t next = 0; next < kSamples;) {
    while (::epoll_wait(loop.get(), &event, 1, -1) != 1) {
    }
    while (auto sample = in.take()) ASSERT_EQ((**sample).value, next++);
  }
  sender.join();
}

// Nor where it is disarmed in between: what was accepted meanwhile is found by the takes, or by the
// last look of arming.
TEST(Descriptor, LosesNoWakeUpWhereItIsDisarmedInBetween) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in", {.depth = 4, .when_full = refuse_new});
  constexpr std::int64_t kSamples = 10000;
  const int fd = in.fd();
  std::thread sender([&] {
    for (std::int64_t i = 0; i < kSamples;) i += out.publish(Number{i}).delivered;
  });
  for (std::int64_t next = 0; next < kSamples;) {
    wait_until_readable(fd);
    for (int i = 0; i < 3; ++i) {
      in.disarm();
      while (auto sample = in.take()) ASSERT_EQ((**sample).value, next++);
    }
    while (auto sample = in.take()) ASSERT_EQ((**sample).value, next++);
  }
  sender.join();
}

TEST(Descriptor, SeveralPortsWaitInOneLoop) {
  constexpr std::uint64_t kPorts = 8;
  Daemon daemon(fan_out_model(kPorts));
  Node node("test");
  auto out = node.output_port<Number>("/out");
  std::vector<InputPort<Number>> inputs;
  const shm::FileDescriptor loop(epoll_create1(EPOLL_CLOEXEC));
  for (std::uint64_t i = 0; i < kPorts; ++i) {
    inputs.push_back(node.input_port<Number>("/in" + std::to_string(i)));
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.u64 = i;
    ASSERT_EQ(epoll_ctl(loop.get(), EPOLL_CTL_ADD, inputs.back().fd(), &event), 0);
    EXPECT_FALSE(inputs.back().take());
  }
  for (int round = 0; round < 100; ++round) {
    EXPECT_EQ(out.publish(Number{round}).delivered, kPorts);
    for (std::uint64_t received = 0; received < kPorts;) {
      epoll_event events[kPorts];
      const int count = ::epoll_wait(loop.get(), events, kPorts, -1);
      for (int i = 0; i < count; ++i) {
        auto& in = inputs[events[i].data.u64];
        while (auto sample = in.take()) {
          EXPECT_EQ((**sample).value, round);
          ++received;
        }
      }
    }
  }
}

// Of this process, which has few of them, and one more at each try, until a node can be made.
TEST(Descriptor, ANodeThatFindsTooFewSaysSo) {
  Daemon daemon(single_model());
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  const int next = ::dup(STDERR_FILENO);
  ASSERT_GE(next, 0);
  ::close(next);
  std::vector<std::string> whys;
  bool is_made = false;
  for (int more = 1; !is_made && more < 100; ++more) {
    const rlimit few{static_cast<rlim_t>(next + more), before.rlim_max};
    std::string why;
    ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &few), 0);
    try {
      const Node node("test", {.connect_timeout = 0ms, .service_thread = false});
      is_made = true;
    } catch (const Error& error) {
      why = error.what();
    }
    ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &before), 0);
    if (!is_made) whys.push_back(std::move(why));
  }
  EXPECT_TRUE(is_made);
  const std::string lost = "process " + std::to_string(::getpid()) +
                           " has no descriptor left for what the daemon sends: raise RLIMIT_NOFILE "
                           "(ulimit -n, LimitNOFILE= in a systemd unit)";
  EXPECT_THAT(whys, testing::Contains(lost));
  EXPECT_THAT(whys, testing::Each(testing::Not(testing::HasSubstr("memfd"))));
}

}  // namespace
}  // namespace arbiter::test
