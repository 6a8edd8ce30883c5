// A gateway some of whose ports cannot be opened, by the policy or because somebody has them.
#include "gateway/core/bridge.hpp"

#include <gmock/gmock.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <list>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include <arbiter/arbiter.hpp>

#include "tests/gateway/foreign.hpp"
#include "tests/gateway/mapping_text.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/run_program.hpp"

namespace arbiter::gateway {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kDriving =
    "<behaviors timeout='60s'>"
    "<behavior name='Drive'><config at='/Base/cmd:i'>/Nav/cmd:o</config></behavior>"
    "<behavior name='Steer'><config at='/Base/cmd:i'>/Joy/cmd:o</config>"
    "<inhibition>Drive</inhibition></behavior></behaviors>";

constexpr const char* kEntries =
    "<in topic='/nav' type='a/msg/B' port='/Nav/cmd:o' max_size='64'/>"
    "<in topic='/joy' type='a/msg/B' port='/Joy/cmd:o' max_size='64'/>"
    "<out port='/Base/cmd:i' topic='/base' type='a/msg/B' idle='zero' size='4'/>";

// As long as it takes, for a test has an end of its own.
template <class Condition>
void await(Condition condition) {
  while (!condition()) ::usleep(1000);
}

// Delivers what the test says, on the test's thread.
class PlayedMiddleware : public Middleware {
 public:
  Sender& sender(const Gateway&, const Entry&, Account&) override { return sender_; }
  void start(const std::vector<OpenIn>& ins, const std::vector<OpenOut>& outs) override {
    const std::lock_guard lock(mutex_);
    for (const OpenIn& in : ins) {
      const std::string& name = in.incoming.entry().ports().front()->name;
      ins_[name] = &in.incoming;
      accounts_[name] = &in.account;
    }
    for (const OpenOut& out : outs) accounts_[out.outgoing.entry().port->name] = &out.account;
    outs_ += outs.size();
  }
  void stop() noexcept override {
    if (const auto call = std::exchange(at_stop, {})) call();
  }
  // In each round of the loop.
  void tend() override {
    if (at_tend) at_tend();
    ++tends_;
  }

  [[nodiscard]] int tends() const { return tends_; }
  [[nodiscard]] std::vector<std::string> sent() {
    const std::lock_guard lock(mutex_);
    return sender_.sent;
  }
  [[nodiscard]] bool serves(const std::string& source) {
    const std::lock_guard lock(mutex_);
    return ins_.count(source) != 0;
  }
  [[nodiscard]] std::size_t outs() {
    const std::lock_guard lock(mutex_);
    return outs_;
  }
  [[nodiscard]] Account& account(const std::string& port) {
    const std::lock_guard lock(mutex_);
    return *accounts_.at(port);
  }
  [[nodiscard]] Incoming* in(const std::string& source) {
    const std::lock_guard lock(mutex_);
    return ins_.at(source);
  }
  Incoming::Fate deliver(const std::string& source, const std::string& bytes) {
    return in(source)->deliver(BytesSample(bytes), Time::max());
  }

  std::function<void()> at_stop{};  // once
  std::function<void()> at_tend{};  // on the loop's thread; set before that runs

 private:
  // On the loop's thread and the test's.
  class LockedSender : public Sender {
   public:
    explicit LockedSender(std::mutex& mutex) : mutex_(mutex) {}
    [[nodiscard]] Result send(Bytes sample) noexcept override {
      const std::lock_guard lock(mutex_);
      sent.emplace_back(reinterpret_cast<const char*>(sample.data()), sample.size());
      return Result::kSent;
    }
    std::vector<std::string> sent;

   private:
    std::mutex& mutex_;
  };

  std::mutex mutex_;
  LockedSender sender_{mutex_};
  std::map<std::string, Incoming*> ins_;
  std::map<std::string, Account*> accounts_;  // by their ports
  std::size_t outs_ = 0;
  std::atomic<int> tends_{0};
};

// A gateway that runs.
class Running {
 public:
  explicit Running(const std::string& name = "gateway", const std::string& entries = kEntries,
                   std::function<void()> at_tend = {})
      : stop_(::eventfd(0, EFD_CLOEXEC)) {
    middleware.at_tend = std::move(at_tend);
    mappings_.push_back(read_dds(entries).mapping);
    bridge_.emplace(BridgeOptions{name, "", [this] { ++signs_; }}, mappings_, Kind::kDds, bell_,
                    middleware);
    thread_ = std::thread([this] { bridge_->run(stop_.get()); });
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  ~Running() {
    if (thread_.joinable()) end();
  }
  void end() {
    const std::uint64_t one = 1;
    EXPECT_EQ(::write(stop_.get(), &one, sizeof one), static_cast<ssize_t>(sizeof one));
    thread_.join();
  }

  // So many times it has asked for a port: a sign of life comes after each, and in each round.
  [[nodiscard]] int tries() const { return signs_ - middleware.tends(); }

  PlayedMiddleware middleware;

 private:
  std::atomic<int> signs_{0};
  shm::FileDescriptor stop_;
  Bell bell_;
  std::vector<Mapping> mappings_;
  std::optional<Bridge> bridge_;
  std::thread thread_;
};

class Refused : public testing::Test {
 protected:
  // Whoever runs the tests: a line that names everyone counts for root, too.
  void start(const std::string& denied) {
    daemon_.emplace(kDriving,
                    test::Daemon::Options{
                        .arguments = {"--policy", files_.write("policy", policy_without(denied))}});
  }
  void reload(const std::string& denied) {
    files_.write("policy", policy_without(denied));
    daemon_->load(kDriving);
  }
  static std::string policy_without(const std::string& denied) {
    return (denied.empty() ? "" : "deny everyone " + denied + "\n") + "allow everyone all\n";
  }
  std::string described(const std::string& source) {
    const auto status = daemon_->source(source);
    return status.contains("described") ? status["described"].get<std::string>() : "";
  }
  // The program, to its end.
  static std::string arbiter(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), ARBITER_PROGRAMS "/arbiter");
    return test::run_program(arguments, {}).out;
  }
  [[nodiscard]] std::size_t refusals_in_the_log(const std::string& port) const {
    const std::string text = "may not open the output port " + port;
    const std::string log = daemon_->log();
    std::size_t count = 0;
    for (auto at = log.find(text); at != std::string::npos; at = log.find(text, at + 1)) ++count;
    return count;
  }

  test::TemporaryDirectory files_;
  std::optional<test::Daemon> daemon_;
};

TEST_F(Refused, AnEntryIsLeftOutAndTheOthersAreServed) {
  start("output /Nav/*");
  Running gateway;
  await([&] { return gateway.middleware.serves("/Joy/cmd:o") && gateway.middleware.outs() == 1; });
  EXPECT_FALSE(gateway.middleware.serves("/Nav/cmd:o"));
  EXPECT_EQ(gateway.middleware.deliver("/Joy/cmd:o", "left"), Incoming::Fate::kPassed);
  await([&] { return daemon_->input("/Base/cmd:i")["taken"] == 1; });
}

TEST_F(Refused, StatusAndWhySayWhoMayNotAndByWhichLine) {
  start("output /Nav/*");
  Running gateway;
  await([&] { return !daemon_->status()["refusals"].empty(); });
  const std::string who = "gateway (pid " + std::to_string(::getpid()) + ")";
  EXPECT_THAT(arbiter({"status"}), AllOf(HasSubstr("refused to " + who),
                                         HasSubstr("policy:1 says: deny everyone output /Nav/*")));
  EXPECT_THAT(arbiter({"why", "/Base/cmd:i", "/Nav/cmd:o"}),
              AllOf(HasSubstr("component " + who + " asked for the port "),
                    HasSubstr(" ago and was refused: "),
                    HasSubstr("may not open the output port /Nav/cmd:o")));
}

TEST_F(Refused, AnEntryIsTakenUpOnceThePolicyAllowsIt) {
  start("output /Nav/*");
  Running gateway;
  await([&] { return !daemon_->status()["refusals"].empty(); });
  reload("");
  await([&] { return gateway.middleware.serves("/Nav/cmd:o") && gateway.middleware.outs() == 1; });
  EXPECT_EQ(gateway.middleware.deliver("/Nav/cmd:o", "on"), Incoming::Fate::kPassed);
  await([&] { return daemon_->input("/Base/cmd:i")["taken"] == 1; });
  await([&] { return described("/Nav/cmd:o") != ""; });
  EXPECT_TRUE(daemon_->status()["refusals"].empty());
  EXPECT_THAT(arbiter({"status"}), Not(HasSubstr("refused to")));
}

TEST_F(Refused, APortThatMayNotBeReadIsTakenUpToo) {
  start("input /Base/*");
  Running gateway;
  await([&] {
    return gateway.middleware.serves("/Nav/cmd:o") && !daemon_->status()["refusals"].empty();
  });
  EXPECT_EQ(gateway.middleware.outs(), 0u);
  EXPECT_THAT(arbiter({"why", "/Base/cmd:i"}),
              HasSubstr("may not open the input port /Base/cmd:i"));
  gateway.middleware.deliver("/Nav/cmd:o", "nobody takes it");
  reload("");
  await([&] { return gateway.middleware.outs() == 1; });
  gateway.middleware.deliver("/Nav/cmd:o", "on");
  await([&] { return daemon_->input("/Base/cmd:i")["taken"] == 1; });
}

TEST_F(Refused, OfATopicThatIsTwoSourcesNeitherIsOpenedWhereOneMayNotBe) {
  start("output /EStop/released:o");
  Running gateway("gateway",
                  "<in topic='/stop' type='std_msgs/msg/Bool' true='/EStop/pressed:o' "
                  "false='/EStop/released:o'/>");
  await([&] { return !daemon_->status()["refusals"].empty(); });
  EXPECT_FALSE(gateway.middleware.serves("/EStop/pressed:o"));
  reload("");
  await([&] { return gateway.middleware.serves("/EStop/pressed:o"); });
}

// Asked to yield each second, a link that stands in for it would stop and start all the time.
TEST_F(Refused, WhileOneOfTwoSourcesMayNotBeOpenedTheOtherIsLeftAlone) {
  start("output /EStop/released:o");
  Running gateway("gateway",
                  "<in topic='/stop' type='std_msgs/msg/Bool' true='/EStop/pressed:o' "
                  "false='/EStop/released:o'/>");
  await([&] { return !daemon_->status()["refusals"].empty(); });
  Node link("link");
  std::optional<OutputPort<void>> stand_in;
  await([&] {  // the gateway closes its own
    try {
      OutputPortOptions options;
      options.yields = true;
      stand_in.emplace(link.output_port("/EStop/pressed:o", options));
    } catch (const Error&) {
    }
    return stand_in.has_value();
  });
  for (int i = 0; i < 2; ++i) {
    const auto last = daemon_->status()["refusals"];
    await([&] { return stand_in->asked_to_yield() || daemon_->status()["refusals"] != last; });
  }
  EXPECT_FALSE(stand_in->asked_to_yield());
  reload("");
  await([&] { return stand_in->asked_to_yield(); });
  stand_in.reset();
  await([&] { return gateway.middleware.serves("/EStop/pressed:o"); });
}

// It asks again every second.
TEST_F(Refused, TheDaemonsLogSaysItOnce) {
  start("output /Nav/*");
  Running gateway;
  await([&] { return !daemon_->status()["refusals"].empty(); });
  const auto first = daemon_->status()["refusals"][0]["at_ns"];
  for (int i = 0; i < 2; ++i) {
    const auto last = daemon_->status()["refusals"][0]["at_ns"];
    await([&] { return daemon_->status()["refusals"][0]["at_ns"] != last; });
  }
  EXPECT_NE(daemon_->status()["refusals"][0]["at_ns"], first);
  EXPECT_EQ(refusals_in_the_log("/Nav/cmd:o"), 1u);
}

TEST_F(Refused, WhoMayOpenNothingWaits) {
  start("output,input *");
  Running gateway;
  await([&] { return daemon_->status()["refusals"].size() == 3; });
  reload("");
  await([&] { return gateway.middleware.serves("/Nav/cmd:o"); });
  await([&] { return gateway.middleware.outs() == 1; });
}

TEST_F(Refused, APortThatSomebodyElseHasIsTakenUpWhenItIsFree) {
  start("");
  Node node("other");
  std::optional<OutputPort<void>> taken(node.output_port("/Nav/cmd:o"));
  Running gateway;
  await([&] { return gateway.middleware.serves("/Joy/cmd:o"); });
  EXPECT_FALSE(gateway.middleware.serves("/Nav/cmd:o"));
  taken.reset();
  await([&] { return gateway.middleware.serves("/Nav/cmd:o"); });
}

// While it waits for an answer it serves nobody: it must not wait again in each of its rounds.
void expect_that_it_seldom_asks(Running& gateway) {
  const int tends = gateway.middleware.tends();
  const int tries = gateway.tries();
  await([&] { return gateway.middleware.tends() >= tends + 40; });
  EXPECT_LT(gateway.tries() - tries, 10);
}

TEST_F(Refused, ADaemonThatIsStoppedIsSeldomAsked) {
  start("output /Nav/*");
  Running gateway;
  await([&] { return gateway.middleware.outs() == 1; });
  daemon_->process().stop();
  expect_that_it_seldom_asks(gateway);
  daemon_->process().resume();
}

// It is not let in as a watcher, so it does not learn that the daemon has gone.
TEST_F(Refused, ADaemonThatHasGoneIsSeldomAskedByWhoMayNotObserve) {
  start("observe\ndeny everyone output /Nav/*");
  Running gateway;
  await([&] { return gateway.middleware.outs() == 1; });
  daemon_->kill();
  expect_that_it_seldom_asks(gateway);
}

// Whatever each of them got first, no entry is without a gateway, and none has two.
TEST_F(Refused, TwoGatewaysOfTheSameMappingShareItAndOneTakesUpWhatTheOtherHad) {
  start("");
  std::optional<Running> one("one");
  Running two("two");
  const auto outs = [&] { return one->middleware.outs() + two.middleware.outs(); };
  const auto serving = [&](const std::string& source) {
    return one->middleware.serves(source) + two.middleware.serves(source);
  };
  await([&] { return serving("/Nav/cmd:o") != 0 && serving("/Joy/cmd:o") != 0 && outs() != 0; });
  EXPECT_EQ(serving("/Nav/cmd:o"), 1);
  EXPECT_EQ(serving("/Joy/cmd:o"), 1);
  EXPECT_EQ(outs(), 1u);
  one.reset();
  await([&] {
    return two.middleware.serves("/Nav/cmd:o") && two.middleware.serves("/Joy/cmd:o") &&
           two.middleware.outs() == 1;
  });
}

TEST(Bridging, WhatKeepsATopicFromWorkingIsTroubleInTheStatus) {
  test::Daemon daemon{kDriving};
  Running gateway;
  await([&] { return gateway.middleware.serves("/Nav/cmd:o") && gateway.middleware.outs() == 1; });
  const auto is_trouble = [&](const char* source) {
    const auto status = daemon.source(source);
    return status.contains("described") && status["trouble"] == true;
  };
  gateway.middleware.account("/Nav/cmd:o").set_obstacle("its QoS does not match");
  await([&] { return is_trouble("/Nav/cmd:o"); });
  EXPECT_FALSE(is_trouble("/Joy/cmd:o"));
  gateway.middleware.account("/Nav/cmd:o").set_obstacle("");
  await([&] { return !is_trouble("/Nav/cmd:o"); });
  gateway.middleware.account("/Base/cmd:i").set_obstacle("its QoS does not match");
  await([&] { return daemon.input("/Base/cmd:i")["trouble"] == true; });
}

// What a topic that keeps samples brings may be an arrival only where T is for ever.
TEST(Bridging, TheMiddlewareLooksWithTheTOfTheModelInForce) {
  const auto model = [](bool is_forever) {
    return std::string("<behaviors timeout='") + (is_forever ? "forever" : "60s") +
           "'><behavior name='Drive'><config at='/Base/cmd:i'>/Nav/cmd:o</config></behavior>"
           "</behaviors>";
  };
  constexpr int kLoads = 12;  // some of them right before the loop asks for T anyway
  test::Daemon daemon{model(true)};
  std::atomic<const Incoming*> nav{nullptr};
  std::atomic<int> loads{0};
  std::atomic<int> wrong{0};
  Running gateway("gateway", kEntries, [&] {
    const Incoming* const in = nav;
    if (in == nullptr || loads == kLoads) return;
    if (in->max_age().is_forever() != (loads % 2 == 0)) ++wrong;
    daemon.load(model((loads + 1) % 2 == 0));
    ++loads;
  });
  await([&] { return gateway.middleware.serves("/Nav/cmd:o"); });
  nav = gateway.middleware.in("/Nav/cmd:o");
  await([&] { return loads == kLoads; });
  EXPECT_EQ(wrong, 0);
}

// Nobody else tells the robot, where no service manager does; and its last command would stay.
TEST(Ending, SaysStopWhoeverCommandsAndNothingBehindIt) {
  test::Daemon daemon{kDriving};
  Running gateway;
  await([&] { return gateway.middleware.serves("/Nav/cmd:o") && gateway.middleware.outs() == 1; });
  const auto is_driving = [&] {
    return !gateway.middleware.sent().empty() && gateway.middleware.sent().back() == "drive";
  };
  gateway.middleware.deliver("/Nav/cmd:o", "drive");
  await(is_driving);
  std::vector<std::string> sent;
  gateway.middleware.at_stop = [&] {  // until then a middleware's threads deliver
    gateway.middleware.deliver("/Nav/cmd:o", "drive");
    sent = gateway.middleware.sent();
  };
  gateway.end();
  // The network may lose one.
  ASSERT_GE(sent.size(), 4u);
  EXPECT_THAT(std::vector(sent.end() - 4, sent.end()),
              testing::ElementsAre("drive", kZeros, kZeros, kZeros));
}

// Where another gateway serves the entry, a stop would be a command of its own.
TEST(Ending, SaysNothingWhereSomebodyElseHasThePort) {
  test::Daemon daemon{kDriving};
  Node node("other");
  const auto taken = node.input_port("/Base/cmd:i");
  Running gateway;
  await([&] { return gateway.middleware.serves("/Nav/cmd:o"); });
  gateway.end();
  EXPECT_THAT(gateway.middleware.sent(), testing::IsEmpty());
}

}  // namespace
}  // namespace arbiter::gateway
