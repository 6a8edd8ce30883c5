// Rule 7 of docs/hosts.md: what a camera of 1 MiB at 30 Hz costs the network while it loses at the
// other host, and what its return costs: at most one period (33 ms) and a round trip.
#include <poll.h>

#include <array>
#include <cstring>
#include <memory>

#include "bench/harness/hosts.hpp"
#include "bench/measures/measures.hpp"

namespace arbiter::bench {
namespace {

constexpr const char* kCamera = "/Camera:o";
constexpr const char* kPause = "/Pause:o";
constexpr const char* kView = "/View:i";
constexpr std::size_t kImageBytes = std::size_t{1} << 20;
constexpr std::int64_t kFrameNs = 1'000'000'000 / 30;

// The camera is shown, but for a pause.
constexpr const char* kViewModel = R"(<behaviors timeout="500ms">
  <source port="/Pause:o" timeout="forever"/>
  <behavior name="Watch"><config at="/View:i">/Camera:o</config></behavior>
  <behavior name="Pause"><config at="/View:i">/Pause:o</config><inhibition>Watch</inhibition>
  </behavior></behaviors>)";

struct Stamp {
  std::int64_t sent_ns;
};

void be_camera(Conversation& with, const Robot& robot) {
  Node node = robot.node("camera");
  auto port = node.output_port(kCamera, Type::variable("bench/Image", kImageBytes));
  with.say(1);
  std::uint64_t word = 0;
  std::int64_t next = now_ns();
  for (bool lives = true; lives;) {
    auto loan = port.loan(kImageBytes);
    if (loan) {
      const Stamp stamp{now_ns()};
      std::memcpy(loan->data(), &stamp, sizeof stamp);
      port.publish(std::move(*loan));
    }
    next += kFrameNs;
    const std::int64_t wait = next - now_ns();
    if (wait > 0) {
      const timespec time{0, wait};
      ::nanosleep(&time, nullptr);
    }
    pollfd heard{with.descriptor(), POLLIN, 0};
    if (::poll(&heard, 1, 0) == 1) lives = with.hear_or_end(word);
  }
}

enum Wish : std::uint64_t { kPauseIt, kGoOn, kAwaitImage };

// kAwaitImage: says how old the next image is.
void be_view(Conversation& with, const Robot& robot) {
  Node node = robot.node("view");
  auto pause = node.output_port<Stamp>(kPause);
  auto in = node.input_port(kView);
  with.say(1);
  std::uint64_t wish = 0;
  while (with.hear_or_end(wish)) {
    if (wish == kPauseIt) {
      pause.signal();
      static_cast<void>(in.take());  // drops what waits
    }
    if (wish == kGoOn) pause.deactivate();
    std::int64_t age = 0;
    for (const std::int64_t end = now_ns() + 2'000'000'000;
         wish == kAwaitImage && age == 0 && now_ns() < end;) {
      const auto sample = in.wait_for(std::chrono::milliseconds(100));
      if (!sample) continue;
      Stamp stamp{};
      std::memcpy(&stamp, sample->data(), sizeof stamp);
      age = now_ns() - stamp.sent_ns;
    }
    with.say(static_cast<std::uint64_t>(age));
  }
}

class Scene {
 public:
  Scene() {
    head_.start_link();
    base_.start_link();
    camera_ = Worker("camera", [this](Conversation& with) { be_camera(with, head_.robot()); });
    view_ = Worker("view", [this](Conversation& with) { be_view(with, base_.robot()); });
    static_cast<void>(camera_.hear());
    static_cast<void>(view_.hear());
    await_in_a_minute("a first image", [&] { return ask(kAwaitImage) != 0; });
  }
  // 0: no image has come.
  std::int64_t ask(Wish wish) {
    view_.say(wish);
    return static_cast<std::int64_t>(view_.hear());
  }
  double age_of_image() {
    const std::int64_t age = ask(kAwaitImage);
    if (age == 0) throw BenchError("no image has come for two seconds");
    return static_cast<double>(age);
  }
  // On the wire, in a second.
  double bytes_a_second(double seconds) {
    const std::uint64_t before = head_.space().bytes();
    const std::int64_t began = now_ns();
    ::poll(nullptr, 0, static_cast<int>(seconds * 1000));
    return static_cast<double>(head_.space().bytes() - before) * 1e9 /
           static_cast<double>(now_ns() - began);
  }
  // Until samples stay at home.
  void lose() {
    ask(kPauseIt);
    ::poll(nullptr, 0, 400);
  }

 private:
  NetworkSwitch network_;
  LinkedHost head_{"head", model(declared({kCamera})), network_};
  LinkedHost base_{"base", kViewModel, network_};
  Worker camera_;
  Worker view_;
};

void measure_camera(Measure& measure, bool quick) {
  Scene scene;
  const double seconds = quick ? 1 : 5;
  const double winning = scene.bytes_a_second(seconds);
  scene.lose();
  const double losing = scene.bytes_a_second(seconds);
  measure.cases.push_back(
      {kOnTheWire,
       {},
       {{kWinsThere, Role::kOurs, {}, winning, {}}, {kLosesThere, Role::kOurs, {}, losing, {}}},
       "bytes/s"});
  Histogram always;
  Histogram again;
  for (int i = 0; i < (quick ? 3 : 20); ++i) {
    scene.ask(kGoOn);
    again.add(scene.age_of_image());
    for (int n = 0; n < 5; ++n) always.add(scene.age_of_image());
    scene.lose();
  }
  measure.cases.push_back({"1 MiB, one way",
                           {},
                           {{"that is always sent", Role::kOurs, always, {}, {}},
                            {"the first that wins again", Role::kOurs, again, {}, {}}}});
}

}  // namespace

Measure measure_hosts_losers(const Effort& effort) {
  Measure measure{
      "hosts-losers", "Losers stay at home",
      "A camera on one host publishes 1 MiB at 30 Hz; the other host's model shows it, "
      "or lets something of its own override it. What crosses the network while it "
      "wins and while it loses, both ways, with all headers and the links' own "
      "messages; and how old an image is when it is taken: one of those that are "
      "always sent, and the first after the camera wins again, which is sent after "
      "the other host has seen its header (rule 7 of docs/hosts.md: the port waits at most "
      "one period and a round trip longer)."};
  try {
    measure_camera(measure, effort.quick);
  } catch (const std::exception& error) {
    measure.cases.push_back({kOnTheWire, {}, {absent(kLosesThere, Role::kOurs, error.what())}});
  }
  return measure;
}

}  // namespace arbiter::bench
