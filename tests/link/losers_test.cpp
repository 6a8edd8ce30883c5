// Rule 7 of docs/hosts.md, losers stay at home: samples of more than 1 KiB that have won nowhere
// for 100 ms do not cross, and are there when they win again.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <map>
#include <mutex>
#include <optional>

#include "gateway/dds/arrived_sample.hpp"
#include "link/core/event_header.hpp"
#include "link/dds/event_topic.hpp"
#include "link/dds/network.hpp"
#include "shm/clock.hpp"
#include "tests/cli/arbiter_program.hpp"
#include "tests/link/cabled_robot.hpp"
#include "tests/link/camera.hpp"
#include "tests/link/known_hosts.hpp"

namespace arbiter::test {
namespace {

using link::Demand;
using link::EventKind;
using testing::HasSubstr;
using testing::Not;

// Where the camera has its T, and nothing is connected.
constexpr const char* kCameraOnly =
    "<behaviors timeout='500ms'><source port='/Camera/image:o'/></behaviors>";

constexpr const char* kOnlySensed = R"(<behaviors timeout='500s'>
    <behavior name="Watch"><config at="/View/image:i">/Other/image:o</config>
      <condition>/Camera/image:o</condition></behavior>
  </behaviors>)";

// Sees what crosses the network, as a reader that wants what `demand` says.
class Eavesdropper : private gateway::dds::SampleTaker {
 public:
  Eavesdropper(const link::Network& network, Demand demand)
      : reader_(network, kCamera, *this, bell_, {99, demand}) {}
  ~Eavesdropper() override = default;
  Eavesdropper(const Eavesdropper&) = delete;
  Eavesdropper& operator=(const Eavesdropper&) = delete;

  [[nodiscard]] int seen(EventKind kind) const { return of(kind).count; }
  [[nodiscard]] std::size_t bytes(EventKind kind) const { return of(kind).bytes; }

 private:
  void take(const gateway::dds::Payload& payload,
            const gateway::dds::SampleWriter& /*writer*/) noexcept override {
    const std::lock_guard lock(mutex_);
    std::array<std::byte, link::kMaxHeaderBytes> bytes;
    const std::size_t before = link::encapsulation().size();
    const WritableBytes beginning(bytes.data(), std::min(payload.size - before, bytes.size()));
    ASSERT_TRUE(gateway::dds::ArrivedSample(payload).copy(before, beginning));
    link::EventHeader header;
    ASSERT_TRUE(link::read_header(beginning, payload.size - before, header));
    ++kinds_[header.kind].count;
    kinds_[header.kind].bytes += payload.size;
  }
  struct Seen {
    int count = 0;
    std::size_t bytes = 0;
  };
  [[nodiscard]] Seen of(EventKind kind) const {
    const std::lock_guard lock(mutex_);
    const auto found = kinds_.find(kind);
    return found == kinds_.end() ? Seen{} : found->second;
  }

  mutable std::mutex mutex_;
  std::map<EventKind, Seen> kinds_;
  const gateway::Bell bell_;
  link::EventReader reader_;
};

// What becomes of the camera's images where they are imported, as a tap that holds none sees it.
class Arrivals {
 public:
  // The camera publishes until the tap sees its source: nothing is missed then.
  Arrivals(Node& node, Camera& camera) : tap_(node.tap(kCamera, without_samples())) {
    test::await([&] {
      camera.publish();
      return tap_.take().has_value();
    });
  }
  // The next of that kind.
  TapEvent<void> await(TapEventKind kind) {
    for (;;) {
      auto event = tap_.wait_for(1s);
      if (event && event->kind() == kind) return std::move(*event);
    }
  }

 private:
  static TapOptions without_samples() {
    TapOptions options;
    options.max_held = 0;
    return options;
  }
  Tap<void> tap_;
};

class Losers : public LoopbackHosts {
 protected:
  // Of what is published for longer than a loser is given. Somebody else reads the source by now.
  void expect_nothing_withheld(Camera& camera) const {
    for (;;) {
      const Presences before = presences_at("head");
      const Eavesdropper ear(here_, Demand::kHeaders);
      const shm::Nanoseconds end = shm::monotonic_now() + 3 * link::ImportDemand::kLosesFor;
      while (shm::monotonic_now() < end || ear.seen(EventKind::kSample) < 20) {
        camera.publish();
        ::poll(nullptr, 0, 3);
      }
      const int withheld = ear.seen(EventKind::kWithheld);
      if (presences_at("head") != before) continue;  // whoever is lost wants nothing
      EXPECT_EQ(withheld, 0);
      return;
    }
  }

  const link::Network here_{{domain_.number(), {}, {}}};
  Host head_{"head", runtime_, kNoRules, network()};
};

// The camera of the head, which the base has shown, and which loses there now.
class ALoser : public Losers {
 protected:
  ALoser() {
    view_.watch(camera_);
    view_.pause();
    lose(base_, camera_);
  }

  Host base_{"base", runtime_, view_model("500s"), network()};
  Camera camera_{head_};
  View view_{base_};
};

// Once nobody wants samples any more, none is kept for who comes later, and need not want any.
TEST_F(Losers, WhoOnlySensesTheSourceGetsNoSampleAtJoining) {
  Host base("base", runtime_, view_model("500s"), network());
  Camera camera(head_);
  View view(base);
  view.watch(camera);
  const Eavesdropper first(here_, Demand::kHeaders);
  await([&] {
    camera.publish();
    return first.seen(EventKind::kSample) > 0;
  });
  const int states = first.seen(EventKind::kState);
  base.link().signal(SIGTERM);
  EXPECT_EQ(base.link().wait(), 0);
  await([&] { return first.seen(EventKind::kState) > states; });
  const Eavesdropper second(here_, Demand::kHeaders);
  await([&] { return second.seen(EventKind::kState) > 0; });
  EXPECT_EQ(second.seen(EventKind::kSample), 0);
}

// The head may not have come to it when the next one joins.
TEST_F(Losers, NobodyGetsASampleFromBeforeEverybodyHadLeft) {
  Host base("base", runtime_, view_model("500s"), network());
  Camera camera(head_);
  View view(base);
  await([&] {
    view.watch(camera);
    base.link().signal(SIGTERM);
    EXPECT_EQ(base.link().wait(), 0);
    await([&] { return head_.daemon().source(kCamera)["taps"].empty(); });
    bool has_sample = false;
    {
      const Eavesdropper ear(here_, Demand::kSamples);
      await([&] { return ear.seen(EventKind::kState) > 0; });
      has_sample = ear.seen(EventKind::kSample) > 0;
    }
    base.start_link();
    return !has_sample;
  });
}

TEST_F(Losers, OnlyHeadersCrossAndTheNewestImageIsThereWhenItWinsAgain) {
  Host base("base", runtime_, view_model("500s"), network());
  Camera camera(head_);
  View view(base);
  view.watch(camera);
  EXPECT_EQ(withheld_at(base), 0);
  Eavesdropper ear(here_, Demand::kHeaders);
  view.pause();
  lose(base, camera);
  await([&] {
    camera.publish();
    return ear.seen(EventKind::kWithheld) > 0;
  });
  const int samples = ear.seen(EventKind::kSample);
  for (int i = 0; i < 20; ++i) camera.publish();
  await([&] { return ear.seen(EventKind::kWithheld) >= 20; });
  EXPECT_EQ(ear.seen(EventKind::kSample), samples);
  const std::size_t bytes = ear.bytes(EventKind::kWithheld);
  const auto withheld = static_cast<std::size_t>(ear.seen(EventKind::kWithheld));
  EXPECT_LT(bytes, withheld * sizeof(Image) / 100);
  EXPECT_EQ(ear.seen(EventKind::kAgain), 0);
  EXPECT_FALSE(view.in().take());

  Arrivals arrivals(view.node(), camera);
  // Once it is here, nothing that was sent before is on its way, or still being looked at.
  camera.port().deactivate();
  arrivals.await(TapEventKind::deactivation);
  view.go_on();
  const std::int64_t last = camera.publish();  // its header wins
  const auto signalled = arrivals.await(TapEventKind::signal);
  const auto completed = arrivals.await(TapEventKind::sample);
  EXPECT_EQ(completed.time(), signalled.time()) << "no second arrival";
  EXPECT_EQ(completed.origin().sequence, signalled.origin().sequence);
  await([&] { return view.seen(5ms) == last; });
  EXPECT_FALSE(view.seen(5ms)) << "it comes once";
  await([&] { return ear.seen(EventKind::kAgain) > 0; });
  view.watch(camera);
  await([&] { return ear.seen(EventKind::kSample) > samples; });
  EXPECT_EQ(ear.seen(EventKind::kAgain), 1);
  EXPECT_THAT(base.described(kCamera), Not(HasSubstr("lost")));
  EXPECT_THAT(base.described(kCamera), Not(HasSubstr("twice")));
}

TEST_F(ALoser, IsCountedByItsImporter) {
  const auto hosts = [](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"hosts", "--instance", "base"});
    return arbiter(arguments).out;
  };
  await([&] { return hosts({}).find(" withheld\n") != std::string::npos; });
  const auto imports = nlohmann::json::parse(hosts({"--json"}))["imports"];
  ASSERT_EQ(imports.size(), 1U);
  EXPECT_EQ(imports[0]["source"], kCamera);
  EXPECT_GT(imports[0]["withheld"], 0);
}

// A header that is on its way when its source wins again asks for samples before the next image is
// published, or after: then the one before comes first, or not at all.
TEST_F(Losers, TheNewestImageIsThereThoughHeadersWereOnTheirWay) {
  Host base("base", runtime_, view_model("500s"), network());
  Camera camera(head_);
  View view(base);
  view.watch(camera);
  for (int round = 0; round < 5; ++round) {
    view.pause();
    lose(base, camera);
    for (int i = 0; i < round; ++i) camera.publish();
    view.go_on();
    const std::int64_t last = camera.publish();
    await([&] { return view.seen(5ms) == last; });
    EXPECT_FALSE(view.seen(5ms)) << "it comes once";
  }
  EXPECT_THAT(base.described(kCamera), Not(HasSubstr("twice")));
}

TEST_F(ALoser, AHeaderIsAnArrivalAtOnce) {
  camera_.port().deactivate();
  await([&] { return !base_.daemon().source(kCamera)["active"]; });
  camera_.publish();
  await([&] { return base_.daemon().source(kCamera)["active"].get<bool>(); });
}

// What was kept at home is not sent after a deactivation: nothing of it is wanted any more.
TEST_F(ALoser, ADeactivationEndsWhatWasKept) {
  camera_.port().deactivate();
  await([&] { return !base_.daemon().source(kCamera)["active"]; });
  view_.go_on();
  camera_.port().signal();
  await([&] { return view_.in().winner() == kCamera; });
  EXPECT_FALSE(view_.seen(20ms));
  view_.watch(camera_);
}

TEST_F(Losers, AHostWhereItWinsHasItAll) {
  Host base("base", runtime_, view_model("500s"), network());
  Host rear("rear", runtime_, view_model("500s"), network());
  Camera camera(head_);
  View view(base);
  View other(rear);
  view.watch(camera);
  other.watch(camera);
  view.pause();
  expect_nothing_withheld(camera);
  // One that goes wants nothing any more.
  rear.link().kill();
  lose(base, camera);
  rear.start_link();
  other.watch(camera);
}

TEST_F(ALoser, ATapThatReadsSamplesHasThem) {
  auto tap = view_.node().tap(kCamera);
  await([&] {
    camera_.publish();
    while (const auto event = tap.take()) {
      if (event->sample()) return true;
    }
    return false;
  });
}

TEST_F(Losers, APortThatKeepsHasItAll) {
  Host base("base", runtime_, view_model("500s"), network());
  Camera camera(head_);
  Node node = base.node("keeper");
  InputPortOptions options;
  options.keep = true;
  auto in = node.input_port<Image>(kView, options);
  auto pause = node.output_port<Image>(kPause);
  await([&] {
    camera.publish();
    return in.wait_for(5ms).has_value();
  });
  pause.signal();
  expect_nothing_withheld(camera);
}

TEST_F(Losers, ASourceThatNeverBecomesInactiveIsNotWithheld) {
  Host base("base", runtime_, view_model("forever"), network());
  Camera camera(head_);
  View view(base);
  view.watch(camera);
  view.pause();
  expect_nothing_withheld(camera);
}

TEST_F(Losers, OfASourceThatIsOnlySensedNoSampleCrosses) {
  Camera camera(head_);
  Eavesdropper ear(here_, Demand::kHeaders);
  await([&] {
    camera.publish();
    return ear.seen(EventKind::kWithheld) > 0;
  });
  Host base("base", runtime_, kOnlySensed, network());
  await([&] {
    camera.publish();
    const auto source = base.daemon().source(kCamera);
    return !source.is_null() && source["active"].get<bool>();
  });
  EXPECT_EQ(ear.seen(EventKind::kSample) + ear.seen(EventKind::kAgain), 0);
  base.await_described(kCamera, "withheld");
  base.daemon().load(view_model("500s"));
  View view(base);
  view.watch(camera);
}

using CutLosers = Cable;

// Who is cut off while it loses, and wins meanwhile, has the newest image after the cut, and none
// from before.
TEST_F(CutLosers, AChangeDuringACutIsMadeUpFor) {
  CabledRobot robot;
  Host head = robot.head(kCameraOnly);
  Host base = robot.base(view_model("500ms"));
  Camera camera(head);
  View view(base);
  view.watch(camera);
  view.pause();
  lose(base, camera);
  robot.cables.cut(kHead);
  for (int i = 0; i < 20; ++i) camera.publish();
  const std::int64_t unseen = camera.published();
  view.go_on();
  await([&] { return !base.daemon().source(kCamera)["active"].get<bool>(); });
  // What was published is too old by now: not even the last of it is sent after the cut.
  await([&] { return !head.daemon().source(kCamera)["active"].get<bool>(); });
  robot.cables.heal(kHead);
  await([&] {
    camera.publish();
    const auto number = view.seen(5ms);
    EXPECT_GT(number.value_or(unseen + 1), unseen);
    return number.has_value();
  });
}

// It speaks for itself alone.
TEST_F(Losers, AStrangerWhoWantsNothingKeepsNothingFromOthers) {
  Host base("base", runtime_, view_model("500s"), network());
  Camera camera(head_);
  View view(base);
  view.watch(camera);
  Eavesdropper wants_nothing(here_, Demand::kHeaders);
  for (int i = 0; i < 5; ++i) view.watch(camera);
  Eavesdropper says_nonsense(here_, static_cast<Demand>(77));
  await([&] {
    camera.publish();
    return says_nonsense.seen(EventKind::kSample) > 0;
  });
  view.pause();
  expect_nothing_withheld(camera);
}

}  // namespace
}  // namespace arbiter::test
