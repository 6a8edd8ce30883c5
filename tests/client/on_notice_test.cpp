// NodeOptions::on_notice: what it tells, to whom and how often, and what becomes of what it throws.
#include <gtest/gtest.h>
#include <poll.h>

#include <atomic>
#include <map>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "shm/limits.hpp"
#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/descriptor_limit.hpp"
#include "tests/support/hear_all.hpp"

namespace arbiter::test {
namespace {

// Notices, as they were given.
class Notices {
 public:
  [[nodiscard]] NodeOptions options() {
    NodeOptions options;
    options.on_notice = [this](const Notice& notice) {
      const std::lock_guard lock(mutex_);
      all_.push_back(notice);
    };
    return options;
  }
  std::vector<Notice> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(all_, {});
  }

 private:
  std::mutex mutex_;
  std::vector<Notice> all_;
};

struct Wrong {
  float x = 0;
};

const std::string kTypesDiffer =
    " sends arbiter::test::(anonymous namespace)::Wrong (4 bytes, aligned to 4), the input port";
// What is said of it, given the nodes.
std::string types_differ(const std::string& sender, const std::string& receiver) {
  return "/out is not connected to /in: the output port of \"" + sender + "\"" + kTypesDiffer +
         " of \"" + receiver + "\" takes arbiter::test::Number (8 bytes, aligned to 8)";
}

TEST(OnNotice, ARefusalIsKnownToWhoeverOpensThePortWhenItIsOpen) {
  Daemon daemon(single_model());
  Notices of_sender, of_receiver;
  Node sender("sender", of_sender.options());
  Node receiver("receiver", of_receiver.options());
  auto in = receiver.input_port<Number>("/in");
  EXPECT_TRUE(of_receiver.take().empty());
  auto out = sender.output_port<Wrong>("/out");
  const auto by_sender = of_sender.take();
  ASSERT_EQ(by_sender.size(), 1u);
  EXPECT_EQ(by_sender[0].kind, NoticeKind::refused);
  EXPECT_EQ(by_sender[0].port, "/out");
  EXPECT_EQ(by_sender[0].peer, "/in");
  EXPECT_EQ(by_sender[0].text, types_differ("sender", "receiver"));
  auto by_receiver = of_receiver.take();
  while (by_receiver.empty()) by_receiver = of_receiver.take();
  ASSERT_EQ(by_receiver.size(), 1u);
  EXPECT_EQ(by_receiver[0].port, "/in");
  EXPECT_EQ(by_receiver[0].peer, "/out");
  EXPECT_EQ(by_receiver[0].text, types_differ("sender", "receiver"));
}

// Another daemon finds out the same, and it is no news.
TEST(OnNotice, IsCalledOnceForEachPortAndSentence) {
  Daemon daemon(single_model());
  Notices notices;
  Node node("test", notices.options());
  auto in = node.input_port<Number>("/in");
  auto out = node.output_port<Wrong>("/out");
  EXPECT_EQ(notices.take().size(), 2u);
  daemon.load(single_model("1s"));
  daemon.kill();
  daemon.restart();
  EXPECT_TRUE(daemon.source("/out")["open"]);
  auto other = node.output_port<Number>("/other");
  const auto since = notices.take();
  ASSERT_EQ(since.size(), 1u);
  EXPECT_EQ(since[0].port, "/other");
}

TEST(OnNotice, TellsOfPortsThatTheModelDoesNotMention) {
  Daemon daemon(single_model());
  Notices notices;
  Node node("test", notices.options());
  auto out = node.output_port<Number>("/ouut");
  auto known = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/elsewhere");
  const auto given = notices.take();
  ASSERT_EQ(given.size(), 2u);
  EXPECT_EQ(given[0].kind, NoticeKind::unmentioned);
  EXPECT_EQ(given[0].port, "/ouut");
  EXPECT_EQ(given[0].text,
            "the model in force does not mention /ouut, so none of these samples is delivered; did "
            "you mean \"/out\"?");
  EXPECT_EQ(given[1].port, "/elsewhere");
  // A model that has them, and one that has not.
  daemon.load(rules(arbiter_at("/elsewhere", select("/ouut"))));
  hear_all(node);
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
  auto another = node.output_port<Number>("/out2");
  bool told_of_known = false;
  for (const Notice& each : notices.take()) told_of_known |= each.port == "/out";
  EXPECT_TRUE(told_of_known) << "/out is not mentioned any more";
}

TEST(OnNotice, TellsWhatLimitOfMemoryRefusesAConnection) {
  Daemon daemon(fan_out_model(2));
  Notices notices;
  Node node("test", notices.options());
  OutputPortOptions options;
  options.max_memory = sizeof(Image) * 5;  // the loans, a copy, and one queue of one
  auto out = node.output_port<Image>("/out", options);
  auto first = node.input_port<Image>("/in0", {.depth = 1});
  auto second = node.input_port<Image>("/in1", {.depth = 1});
  const auto given = notices.take();
  ASSERT_EQ(given.size(), 2u) << "both ends";
  EXPECT_NE(given[0].text.find("/out is not connected to /in1: max_memory"), std::string::npos)
      << given[0].text;
  EXPECT_EQ(out.publish(std::move(*out.loan())).refused, 1u);
  EXPECT_TRUE(second.idle());
  EXPECT_FALSE(first.idle());
}

// On the service thread, which opens them itself.
TEST(OnNotice, MayOpenAndClosePortsOfTheSameNode) {
  for (const bool service_thread : {true, false}) {
    Daemon daemon(single_model());
    Node* self = nullptr;
    std::optional<OutputPort<Number>> opened;
    std::thread::id called_on;
    std::atomic<bool> is_back{false};
    NodeOptions options;
    options.service_thread = service_thread;
    options.on_notice = [&](const Notice& notice) {
      if (notice.port != "/ouut") return;
      called_on = std::this_thread::get_id();
      { auto closed = self->output_port<Number>("/another"); }
      opened.emplace(self->output_port<Number>("/out"));
      is_back = true;
    };
    Node node("test", options);
    self = &node;
    auto out = node.output_port<Number>("/ouut");
    while (!is_back) node.service();
    EXPECT_EQ(called_on == std::this_thread::get_id(), !service_thread);
    EXPECT_TRUE(daemon.source("/out")["open"]);
  }
}

TEST(OnNotice, WhatItThrowsIsWrittenDownAndHasNoOtherEffect) {
  Daemon daemon(single_model());
  NodeOptions options;
  options.on_notice = [](const Notice&) { throw std::runtime_error("no more"); };
  options.on_waiting = [](const std::string&) {};  // where the machine is slow
  testing::internal::CaptureStderr();
  Node node("test", options);
  auto lost = node.output_port<Number>("/lost");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "arbiter: \"test\": on_notice has thrown: no more\n");
}

TEST(OnNotice, WithoutOneStandardErrorSaysIt) {
  Daemon daemon(single_model());
  NodeOptions options;
  options.on_waiting = [](const std::string&) {};  // where the machine is slow
  testing::internal::CaptureStderr();
  Node node("test", options);
  auto in = node.input_port<Number>("/in");
  auto out = node.output_port<Wrong>("/out");
  const std::string line = "arbiter: \"test\": " + types_differ("test", "test") + "\n";
  EXPECT_EQ(testing::internal::GetCapturedStderr(), line + line) << "the node has both ends";
}

NodeOptions serviced_by_hand(Notices& notices) {
  NodeOptions options = notices.options();
  options.service_thread = false;
  return options;
}

TEST(OnNotice, TellsAReceiverThatNoDescriptorIsLeftForItsPublisher) {
  Daemon daemon(single_model());
  Notices notices;
  Node node("test", serviced_by_hand(notices));
  auto in = node.input_port<Number>("/in");
  Component sender("sender");
  ASSERT_EQ(sender.tell("output /out"), "open");
  testing::internal::CaptureStderr();
  {
    const NoDescriptors none;
    node.service();
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << "who has a callback is told by it";
  const auto given = notices.take();
  ASSERT_EQ(given.size(), 1u);
  EXPECT_EQ(given[0].kind, NoticeKind::refused);
  EXPECT_EQ(given[0].port, "/in");
  EXPECT_EQ(given[0].peer, "/out");
  EXPECT_NE(given[0].text.find("has no descriptor left"), std::string::npos) << given[0].text;
  await([&] { return sender.tell("publish /out 1") == "0 0 1"; });  // once it knows
  EXPECT_TRUE(in.idle());
}

// It is the winner there, so it must hear that nobody gets what it sends.
TEST(OnNotice, TellsAPublisherThatNoDescriptorIsLeftForItsReceiver) {
  Daemon daemon(single_model());
  Notices notices;
  Node node("test", serviced_by_hand(notices));
  auto out = node.output_port<Number>("/out");
  Component receiver("receiver");
  ASSERT_EQ(receiver.tell("input /in 4 1 0"), "open");
  {
    const NoDescriptors none;
    node.service();
  }
  const auto given = notices.take();
  ASSERT_EQ(given.size(), 1u);
  EXPECT_EQ(given[0].kind, NoticeKind::refused);
  EXPECT_EQ(given[0].port, "/out");
  EXPECT_EQ(given[0].peer, "/in");
  const Outcome outcome = out.publish(Number{1});
  EXPECT_EQ(outcome.refused, 1u);
  EXPECT_EQ(outcome.delivered + outcome.discarded, 0u);
  // The next one can be mapped.
  receiver.kill();
  Component successor("successor");
  ASSERT_EQ(successor.tell("input /in 4 1 0"), "open");
  node.service();
  EXPECT_EQ(out.publish(Number{2}).delivered, 1u);
  EXPECT_EQ(successor.tell("take /in"), "2");
}

TEST(OnNotice, APublisherThatGrowsNeedsNoFurtherDescriptor) {
  Daemon daemon(fan_out_model(2));
  Notices notices;
  Node node("test", serviced_by_hand(notices));
  auto in = node.input_port<Number>("/in0");
  Component sender("sender");
  ASSERT_EQ(sender.tell("output /out"), "open");
  node.service();
  Component receiver("receiver");
  const NoDescriptors none;
  ASSERT_EQ(receiver.tell("input /in1 64 1 0"), "open");
  pollfd grown{node.service_fd(), POLLIN, 0};
  ASSERT_EQ(::poll(&grown, 1, -1), 1);
  node.service();
  EXPECT_TRUE(notices.take().empty());
  EXPECT_EQ(sender.tell("publish /out 1"), "2 0 0");
  EXPECT_EQ(take_from(in), 1);
}

TEST(OnNotice, TellsOfAPortThatCannotSee) {
  Daemon daemon(override_model());
  Notices notices;
  Node blind("blind", serviced_by_hand(notices));
  auto in = blind.input_port<Number>("/in");
  Node sender("sender");
  auto low = sender.output_port<Number>("/low");
  // This node is not serviced: it does not see what a new model reads.
  blind.service();
  daemon.load(rules(arbiter_at("/in", select("/low", "not /new"))));
  hear_all(sender);
  EXPECT_EQ(low.publish(Number{1}).delivered, 1u);
  EXPECT_FALSE(in.take());
  blind.service();
  const auto given = notices.take();
  ASSERT_EQ(given.size(), 1u);
  EXPECT_EQ(given[0].kind, NoticeKind::blind);
  EXPECT_EQ(given[0].port, "/in");
  EXPECT_EQ(given[0].text,
            "/in delivers nothing while it cannot see all sources that its rules read");
  EXPECT_EQ(daemon.status()["clients"].is_number(), true);  // the daemon has read on
  EXPECT_NE(daemon.log().find(given[0].text), std::string::npos);
  EXPECT_EQ(take_from(in), 1) << "now it sees";
}

// The daemon has shown it once, and thinks that it is seen.
TEST(OnNotice, TellsThatNoDescriptorIsLeftForASourceAndSeesItOnceThereIs) {
  Daemon daemon(override_model());
  Notices notices;
  Node blind("blind", serviced_by_hand(notices));
  auto in = blind.input_port<Number>("/in");
  Node sender("sender");
  auto low = sender.output_port<Number>("/low");
  blind.service();
  daemon.load(rules(arbiter_at("/in", select("/low", "not /new"))));
  hear_all(sender);
  {
    const NoDescriptors none;
    blind.service();
  }
  const auto given = notices.take();
  ASSERT_EQ(given.size(), 1u);
  EXPECT_EQ(given[0].kind, NoticeKind::blind);
  EXPECT_EQ(given[0].peer, "/new");
  EXPECT_NE(given[0].text.find("has no descriptor left"), std::string::npos) << given[0].text;
  await([&] {
    blind.service();
    low.publish(Number{1});
    return take_from(in) == 1;
  });
}

// While one model comes after another a source may have more input ports than queues.
TEST(OnNotice, TellsThatNoMemoryIsLeftForAPortThatHasWaitedForAQueue) {
  constexpr int kQueues = 64;
  Daemon daemon(fan_out_model(kQueues));
  Notices notices;
  Node node("test", notices.options());
  OutputPortOptions options;
  options.max_loans = 1;
  options.max_memory = shm::kCacheLine * (2 + 2 * std::size_t{kQueues});  // to hold and to wait
  auto out = node.output_port<Number>("/out", options);
  std::vector<InputPort<Number>> inputs;
  for (int i = 0; i < kQueues; ++i) {
    inputs.push_back(node.input_port<Number>("/in" + std::to_string(i), {.depth = 1}));
  }
  auto last = node.input_port<Number>("/last", {.depth = 1, .max_held = kQueues});
  static_cast<void>(notices.take());
  daemon.load(rules(arbiter_at("/last", select("/out"))));
  std::map<std::string, std::string> refused;  // the reasons, by port
  await([&] {
    for (const Notice& each : notices.take()) {
      if (each.kind == NoticeKind::refused) refused[each.port] = each.text;
    }
    return refused.size() == 2;
  });
  const std::string reason =
      "/out is not connected to /last: max_memory of /out leaves no room for another input port";
  EXPECT_EQ(refused["/out"], reason);
  EXPECT_EQ(refused["/last"], reason);
  EXPECT_EQ(out.publish(Number{1}).refused, 1u);
}

}  // namespace
}  // namespace arbiter::test
