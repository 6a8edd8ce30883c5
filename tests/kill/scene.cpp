#include "tests/kill/scene.hpp"

#include <poll.h>

#include <stdexcept>

#include "shm/clock.hpp"
#include "tests/support/threads.hpp"

namespace arbiter::test {
namespace {

constexpr std::uint32_t kDepth = 2;
constexpr std::uint32_t kHeld = 2;
constexpr std::size_t kPorts = 2;

// The victim overrides the first survivor at the survivors' port; the second survivor overrides the
// first at the victim's.
const std::string kModel = R"(<behaviors timeout="forever">
  <arbiter at="/survivor:i">
    <select from="/first:o">not /victim:o</select>
    <select from="/victim:o">true</select>
  </arbiter>
  <arbiter at="/victim:i">
    <select from="/first:o">not /second:o</select>
    <select from="/second:o">true</select>
  </arbiter>
</behaviors>)";

// Exactly what slot_pool.hpp says: a loan, a copy, and for each port what it holds and what waits.
constexpr std::size_t kMemory = 64 * (1 + 1 + kPorts * (kDepth + kHeld));

}  // namespace

Victim::Victim(const std::string& phase, std::uint64_t fatal) {
  int in[2];
  int out[2];
  if (::pipe2(in, O_CLOEXEC) != 0 || ::pipe2(out, O_CLOEXEC) != 0)
    throw std::runtime_error("pipe2");
  const shm::FileDescriptor child_in(in[0]);
  const shm::FileDescriptor child_out(out[1]);
  say_.reset(in[1]);
  hear_.reset(out[0]);
  process_ = ChildProcess({ARBITER_VICTIM, phase, std::to_string(fatal)}, {},
                          {child_in.get(), child_out.get(), -1});
}

std::string Victim::read_line() {
  std::string line;
  for (char c = 0; ::read(hear_.get(), &c, 1) == 1 && c != '\n';) line += c;
  return line;
}

void Victim::prepare() {
  if (const auto said = read_line(); said != "ready") {
    throw std::runtime_error("the victim is not ready, but says: \"" + said + "\"");
  }
}

void Victim::go() { static_cast<void>(!::write(say_.get(), "\n", 1)); }

bool Victim::is_unharmed() {
  const std::string said = read_line();
  if (said == "unharmed") return true;
  if (const int code = process_.wait(); code != 128 + SIGKILL) {
    throw std::runtime_error("the victim ended with " + std::to_string(code));
  }
  return false;
}

void Victim::wait_until_it_polls_or_ends() {
  for (;;) {
    pollfd ended[]{{process_.descriptor(), POLLIN, 0}, {hear_.get(), POLLIN, 0}};
    if (::poll(ended, 2, 0) > 0) return;
    if (call_of(pid(), pid()) == SYS_ppoll && state_of(pid(), pid()) == 'S') return;
  }
}

Scene::Scene() : daemon_(kModel), observer_(daemon_.instance()) {
  meet_daemon();
  node_.emplace("survivors");
}

// Asks for all there is to be seen: the victim's activity page, the id of the survivors' port.
void Scene::meet_daemon() {
  observer_.hello("observer");
  observer_.send(RawClient::message(wire::MessageKind::kObserve));
  wire::Received received;
  while (observer_.receive(received) && received.message.kind != wire::MessageKind::kDone) {
    const auto name = received.message.name_view();
    if (received.message.kind == wire::MessageKind::kSourcePage && name == "/victim:o") {
      source_id_ = received.message.id;
      page_ =
          shm::Mapping(received.descriptors[0], sizeof(shm::ActivityPage), shm::Access::kReadOnly);
    }
    if (received.message.kind == wire::MessageKind::kPortName && name == "/survivor:i") {
      port_id_ = received.message.id;
    }
  }
}

void Scene::open_survivors() {
  const OutputPortOptions exact{.max_loans = 1, .max_memory = kMemory};
  in_.emplace(node_->input_port<Number>("/survivor:i", {.depth = kDepth, .max_held = kHeld}));
  first_.emplace(node_->output_port<Number>("/first:o", exact));
  second_.emplace(node_->output_port<Number>("/second:o", exact));
  second_->deactivate();
}

void Scene::close_survivors() {
  tap_.reset();
  in_.reset();
  first_.reset();
  second_.reset();
}

void Scene::require_all_is_well(const OwnSegments& dead, const shm::Activity& before) {
  died_at_ = std::chrono::steady_clock::now();
  require_survivors_go_on();
  require_page_is_sane(before);
  if (tap_) require_tap_was_told();
  {
    Successor successor;
    succeed(successor);
    require_successor_works(successor);
    require_no_slot_is_lost(successor);
    require_accounts_balance(dead);
    successor.out->deactivate();
  }
}

// Each event once and in order, to the last; then the end, with the activity that the source has.
// What was stamped and not told of counts as lost.
void Scene::require_tap_was_told() {
  const shm::ActivityWord word = page().word.load();
  const auto now = std::chrono::steady_clock::now();
  bool was_active = false;
  std::uint64_t last = 0;
  for (bool has_begun = false;;) {
    const auto event = tap_->wait_for(std::chrono::seconds(10));
    ASSERT_TRUE(event) << "the tap does not hear of the end";
    if (event->kind() == TapEventKind::closed) {
      EXPECT_EQ(event->was_active_at(now), shm::is_active(word, now.time_since_epoch().count()));
      EXPECT_EQ(event->is_deactivated(), shm::is_deactivation(word));
      if (has_begun && event->lost() == 0) {
        EXPECT_EQ(event->was_active_at(now), was_active);
      }
      EXPECT_LE(event->lost(), 1u);
      return;
    }
    EXPECT_EQ(event->lost(), 0u);
    was_active = event->was_active_at(now);
    if (event->kind() == TapEventKind::sample) {
      EXPECT_EQ(event->sequence(), last + 1);
      EXPECT_NE(event->at("/survivor:i"), Fate::none);
      if (event->sample() != nullptr) {
        EXPECT_TRUE(event->sample()->is_whole());
      }
    }
    last = event->sequence();
    has_begun = true;
  }
}

void Scene::require_taps_fit() {
  std::vector<Tap<Number>> taps;
  for (int tries = 0; taps.size() < shm::kMaxTaps; ++tries) {
    try {
      taps.push_back(node_->tap<Number>("/first:o", {.max_held = 4}));
    } catch (const Error& error) {
      ASSERT_LT(tries, 1000) << error.what();
    }
  }
}

void Scene::drain() {
  while (auto sample = in_->take()) EXPECT_TRUE((*sample)->is_whole());
}

// At once, whatever the dead one was about.
void Scene::require_survivors_go_on() {
  const Outcome outcome = first_->publish(make_number(1));
  EXPECT_GE(outcome.delivered + outcome.discarded, 1u);
  ASSERT_TRUE(first_->loan());
  drain();
}

void Scene::require_page_is_sane(const shm::Activity& before) {
  const shm::ActivityWord word = page().word.load();
  const std::uint64_t breaks = page().breaks.load();
  const std::uint64_t breaks_before = before.breaks.load();
  EXPECT_LE(breaks, breaks_before + 2);
  if (word == before.word.load()) return;
  const shm::Nanoseconds now = shm::monotonic_now();
  const shm::Nanoseconds when = shm::is_deactivation(word) ? word & ~shm::kDeactivatedFlag
                                                           : shm::arrival_of(word, shm::kForever);
  EXPECT_LE(when, now);
  EXPECT_GT(when, now - 60'000'000'000);
  EXPECT_TRUE(shm::is_deactivation(word) || word >= shm::kForeverFlag) << word;
}

// A new process takes the dead one's names; tries until the daemon has noticed.
void Scene::succeed(Successor& successor) {
  const auto until_it_works = [](auto open) {
    for (;;) {
      try {
        return open();
      } catch (const Error& error) {
        if (std::string(error.what()).find("is held by") == std::string::npos) throw;
      }
    }
  };
  until_it_works([&] {
    successor.out.emplace(successor.node.output_port<Number>("/victim:o", {.max_loans = 1}));
  });
  until_it_works([&] {
    successor.in.emplace(
        successor.node.input_port<Number>("/victim:i", {.depth = kDepth, .max_held = kHeld}));
  });
  const auto took = std::chrono::duration_cast<std::chrono::microseconds>(
      std::chrono::steady_clock::now() - died_at_);
  slowest_ = std::max(slowest_, took);
}

void Scene::require_successor_works(Successor& successor) {
  successor.out->deactivate();
  second_->deactivate();
  drain();
  EXPECT_EQ(first_->publish(make_number(2)).delivered, 2u);
  auto sample = in_->take();
  ASSERT_TRUE(sample);
  EXPECT_EQ((*sample)->value, 2u);
  sample.reset();
  EXPECT_EQ(successor.out->publish(make_number(3)).delivered, 1u);
  sample = in_->take();
  ASSERT_TRUE(sample);
  EXPECT_EQ((*sample)->value, 3u);
  sample.reset();
  successor.out->deactivate();
  sample = successor.in->take();
  ASSERT_TRUE(sample);
  EXPECT_EQ((*sample)->value, 2u);
}

// Fills every place that a sample can be in with one of its own: both queues, all that may be held,
// a loan, a copy.
void Scene::require_no_slot_is_lost(Successor& successor) {
  std::vector<Sample<Number>> held;
  std::uint64_t value = 100;
  const auto publish_two = [&] {
    for (int i = 0; i < 2; ++i) static_cast<void>(first_->publish(make_number(value++)));
  };
  const auto hold_two = [&](InputPort<Number>& port) {
    for (int i = 0; i < 2; ++i) {
      auto sample = port.take();
      ASSERT_TRUE(sample);
      held.push_back(std::move(*sample));
    }
  };
  publish_two();  // to both
  hold_two(*in_);
  static_cast<void>(successor.out->signal());
  publish_two();  // to the successor alone
  hold_two(*successor.in);
  successor.out->deactivate();
  publish_two();
  static_cast<void>(successor.out->signal());
  publish_two();
  auto loan = first_->loan();
  ASSERT_TRUE(loan) << "a slot is lost";
  **loan = make_number(value);
  EXPECT_EQ(first_->publish(make_number(value + 1)).delivered, 1u);
  EXPECT_EQ(daemon_.source("/first:o")["no_slot"], 0);
  for (const auto& sample : held) EXPECT_TRUE(sample->is_whole());
  successor.out->deactivate();
}

std::string Scene::imbalance(std::uint64_t accepted_from_dead) {
  drain();
  const auto status = daemon_.status();
  for (const auto& input : status["inputs"]) {
    std::uint64_t accepted = 0;
    std::uint64_t waiting = 0;
    for (const auto& connection : input["connections"]) {
      std::uint64_t accounted = 0;
      for (const char* where : {"taken", "dropped", "overtaken", "waiting"}) {
        accounted += connection[where].get<std::uint64_t>();
      }
      if (connection["accepted"] != accounted) return connection.dump();
      accepted += connection["accepted"].get<std::uint64_t>();
      waiting += connection["waiting"].get<std::uint64_t>();
    }
    if (input["misbehaved"] != 0) return input.dump();
    if (input["name"] != "/survivor:i") continue;
    const std::uint64_t accounted = input["taken"].get<std::uint64_t>() +
                                    input["dropped"].get<std::uint64_t>() +
                                    input["overtaken"].get<std::uint64_t>() + waiting;
    if (accounted != accepted + accepted_from_dead) {
      return std::to_string(accepted_from_dead) + " from the dead: " + input.dump();
    }
  }
  return "";
}

// What the dead one had delivered is taken, or counted where it went.
void Scene::require_accounts_balance(const OwnSegments& dead) {
  std::uint64_t from_dead = 0;
  for (const OwnOutput& output : dead.outputs) from_dead += accepted_for(output.segment, port_id_);
  std::string error = imbalance(from_dead);
  // Its death may be news to the service thread.
  for (int tries = 0; !error.empty() && tries < 1000; ++tries) error = imbalance(from_dead);
  EXPECT_EQ(error, "");
}

}  // namespace arbiter::test
