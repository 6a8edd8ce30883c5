// What a hostile publisher or receiver can do to honest ones, by what it writes into its own
// memory.
//
// The input decides what the honest ports do, step by step, and what each of their loads from
// hostile memory yields: the truth, or garbage, this once or from then on. That is stronger than
// any process that writes as fast as it can. Required of the honest ports:
//   - no crash, no undefined behaviour, no step outside of a segment (sanitizers, guard pages)
//   - each call ends after a bounded number of loads
//   - what they take is allowed by the rules whose sources are honest
//   - samples among them are whole, in order, and counted; no slot is lost
#include <algorithm>
#include <cstdint>
#include <deque>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "tests/fuzz/script.hpp"
#include "tests/fuzz/segments/guarded_mapping.hpp"
#include "tests/fuzz/segments/seam.hpp"
#include "tests/fuzz/segments/world.hpp"
#include "tests/support/segments.hpp"

namespace arbiter::fuzz {
namespace {

// No call of an honest port may load more often, whatever it is told.
constexpr std::uint64_t kMostLoads = 2'000'000;
constexpr std::size_t kMostSeen = 4096;

// Stands between the honest ports and hostile memory.
class Liar : public Seam {
 public:
  explicit Liar(Script& input) : input_(input) {}

  std::uint64_t load(const void* address, std::uint64_t value, std::size_t size) override {
    if (++loads_ > kMostLoads) die("a call does not come to an end");
    if (!is_hostile(address)) return value;
    if (seen_.size() < kMostSeen) seen_.push_back({address, value});
    const auto stuck = stuck_.find(address);
    if (stuck != stuck_.end()) value = stuck->second;
    const std::uint64_t told = tell(address, value);
    last_ = told;
    return size == 8 ? told : told & ((std::uint64_t{1} << 8 * size) - 1);
  }
  void begin_call() noexcept { loads_ = 0; }
  // From now on one of the words that were loaded lately is garbage.
  void stick(std::size_t which) {
    if (seen_.empty()) return;
    const Seen& seen = seen_[seen_.size() - 1 - which % seen_.size()];
    stuck_[seen.address] = garbage(seen.value);
  }

 private:
  std::uint64_t garbage(std::uint64_t value) {
    switch (input_.byte() % 12) {
      case 0:
        return input_.word();
      case 1:
        return value + input_.byte();
      case 2:
        return value - input_.byte();
      case 3:
        return value ^ std::uint64_t{1} << (input_.byte() % 64);
      case 4:
        return last_;
      case 5:
        return 0;
      case 6:
        return ~std::uint64_t{0};
      case 7:
        return value + (std::uint64_t{input_.byte()} << 16);  // a sequence ahead
      case 8:
        return (value & ~std::uint64_t{0xffff}) | input_.byte();  // another slot
      case 9:
        return (value & ~std::uint64_t{0xffff}) | input_.word() >> 48;
      case 10:
        return std::uint64_t{input_.byte()} << (input_.byte() % 64);
      default:
        return value ^ std::uint64_t{1} << 63;
    }
  }

  // The truth, a lie, or one that stays. 0, when the input is used up: the truth.
  std::uint64_t tell(const void* address, std::uint64_t value) {
    switch (input_.byte() % 16) {
      case 3:
      case 7:
        return garbage(value);
      case 11:
        return stuck_[address] = garbage(value);
      case 15:
        stuck_.erase(address);
        return value;
      default:
        return value;
    }
  }

  struct Seen {
    const void* address;
    std::uint64_t value;
  };

  Script& input_;
  std::uint64_t loads_ = 0;
  std::uint64_t last_ = 0;
  std::vector<Seen> seen_;
  std::unordered_map<const void*, std::uint64_t> stuck_;
};

class Run {
 public:
  Run(Script& steps, Script& lies)
      : steps_(steps),
        liar_(lies),
        world_({1 + steps.byte() % 4u, steps.byte() % 2 == 1, steps.byte() % 2 == 1}) {
    Seam::current = &liar_;
  }
  ~Run() { Seam::current = nullptr; }
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;

  void go() {
    for (int i = 0; i < 200 && !steps_.is_at_end(); ++i) {
      liar_.begin_call();
      step();
    }
    finish();
  }

 private:
  struct Held {
    detail::InputCore* port;
    detail::HeldSample sample;
  };

  void step() {
    const std::uint8_t which = steps_.byte();
    if (which >= 224) return step_of_taps(which % 16);
    switch (which % 24) {
      case 0:
      case 1:
        world_.publish(world_.p, false, steps_.byte());
        break;
      case 2:
        world_.publish(world_.p, true, steps_.byte());
        break;
      case 3:
      case 4:
        take(world_.r);
        break;
      case 5:
        take(world_.r2);
        break;
      case 6:
        give_back();
        break;
      case 7:
        wait(world_.r);
        break;
      case 8:
        wait(world_.r2);
        break;
      case 9:
        static_cast<void>(world_.r.winner()), static_cast<void>(world_.r2.is_idle());
        break;
      case 10:
        world_.s.signal(shm::monotonic_now()), s_active_ = true;
        break;
      case 11:
        world_.s.deactivate(shm::monotonic_now()), s_active_ = false;
        break;
      case 12:
      case 13:
        world_.publish(world_.h, steps_.byte() % 2 == 0, steps_.byte());
        break;
      case 14:
        world_.h.deactivate(shm::monotonic_now());
        break;
      case 15:
        x_takes();
        break;
      case 16:
        tidy();
        break;
      case 17:
        world_.r.lose_peer(world_.h.instance());
        break;
      case 18:
        world_.disconnect(world_.h, world_.r), world_.connect(world_.h, world_.r);
        break;
      case 19:
        world_.disconnect(world_.p, world_.x), world_.connect(world_.p, world_.x);
        break;
      case 20:
        world_.publish(world_.p, false, 1), world_.p.deactivate(shm::monotonic_now());
        break;
      case 21:
        liar_.stick(steps_.byte());
        break;
      case 22:
        introduce_output();
        break;
      case 23:
        world_.introduce_input(patches());
        break;
      default:
        break;
    }
  }

  void step_of_taps(std::uint32_t which) {
    if (!std::exchange(is_watched_, true)) world_.watch();
    switch (which) {
      case 0:
        if (!events_.empty()) give_event_back();
        break;
      case 1:
        tap_waits();
        break;
      case 2:
        y_takes();
        break;
      case 3:
        y_gives_back();
        world_.p.remove_tap(world_.y.instance());
        world_.watch(world_.p, world_.y);
        break;
      case 4:
        world_.h.remove_tap(world_.t.instance());
        world_.t.lose_source(world_.h.instance(), shm::ActivityWord{1});
        break;
      case 5:
        world_.introduce_tap(patches());
        break;
      case 6:
        world_.introduce_events(patches());
        break;
      case 7:
        world_.t.lose_input(world_.x.instance());
        break;
      case 8:
        world_.t.tidy();
        static_cast<void>(world_.t.misbehaving());
        break;
      default:
        tap_takes();
        break;
    }
  }

  void tap_takes() {
    if (world_.t.held() == 2) give_event_back();
    detail::TapEventData event;
    if (world_.t.take(event)) keep(std::move(event));
  }
  void tap_waits() {
    if (world_.t.held() == 2) give_event_back();
    detail::TapEventData event;
    if (world_.t.wait(0, event)) keep(std::move(event));
  }
  void keep(detail::TapEventData event) {
    const std::uint64_t number = world_.require_whole(event);
    if (event.context->destinations.size() > shm::kMaxDestinations) die("too many destinations");
    if (number != 0 && number <= last_event_) die("an event of /p came twice, or out of order");
    last_event_ = std::max(last_event_, number);
    if (event.data != nullptr) events_.push_back(std::move(event));
  }
  void give_event_back() {
    static_cast<void>(world_.require_whole(events_.front()));
    world_.t.give_back(events_.front().hold);
    events_.pop_front();
  }
  void y_takes() {
    if (world_.y.held() == 2) y_gives_back();
    detail::TapEventData event;
    if (world_.y.take(event) && event.data != nullptr) y_events_.push_back(event.hold);
  }
  void y_gives_back() {
    for (; !y_events_.empty(); y_events_.pop_back()) world_.y.give_back(y_events_.back());
  }

  // What the service thread does.
  void tidy() {
    for (auto* port : {&world_.r, &world_.r2}) {
      port->tidy();
      static_cast<void>(port->misbehaving());
    }
    world_.p.tidy();
    static_cast<void>(world_.p.misbehaving());
  }

  // Only what the honest sources allow; the picture does not change while we take.
  void require_allowed(const detail::InputCore& port, const detail::HeldSample& sample) {
    if (&port != &world_.r) return;  // the rules of /r2 read a source that lies
    if ((sample.source == world_.h.source()) != s_active_) {
      die("/r took a sample of source " + std::to_string(sample.source) + " while /s was " +
          (s_active_ ? "active" : "not active"));
    }
  }
  void keep(detail::InputCore& port, const detail::HeldSample& sample) {
    require_allowed(port, sample);
    const std::uint64_t number = world_.require_whole(sample);
    std::uint64_t& last = &port == &world_.r ? last_r_ : last_r2_;
    if (number != 0 && number <= last) die("a sample of /p came twice, or out of order");
    last = std::max(last, number);
    held_.push_back({&port, sample});
  }
  void take(detail::InputCore& port) {
    if (port.held() == 2) give_back_one_of(port);
    const detail::HeldSample sample = port.take();
    if (sample.data != nullptr) keep(port, sample);
  }
  void wait(detail::InputCore& port) {
    if (port.held() == 2) give_back_one_of(port);
    detail::HeldSample sample;
    if (port.wait(0, sample) == detail::Waited::kSample) keep(port, sample);
  }
  void give_back(std::size_t index = 0) {
    if (index >= held_.size()) return;
    const Held held = held_[index];
    held_.erase(held_.begin() + static_cast<std::ptrdiff_t>(index));
    world_.require_whole(held.sample);
    held.port->give_back(held.sample.hold);
  }
  void give_back_one_of(const detail::InputCore& port) {
    for (std::size_t i = 0; i < held_.size(); ++i) {
      if (held_[i].port == &port) return give_back(i);
    }
  }
  void x_takes() {
    if (world_.x.held() == 2) x_gives_back();
    const detail::HeldSample sample = world_.x.take();
    if (sample.data != nullptr) x_holds_.push_back(sample.hold);
  }
  void x_gives_back() {
    for (; !x_holds_.empty(); x_holds_.pop_back()) world_.x.give_back(x_holds_.back());
  }

  std::vector<Patch> patches() {
    std::vector<Patch> result(steps_.byte() % 3);
    for (Patch& patch : result) {
      patch.word = steps_.byte();
      // Small, or anything.
      patch.value = steps_.byte();
      if (steps_.byte() % 2 == 0) patch.value = static_cast<std::uint32_t>(steps_.word());
    }
    return result;
  }
  void introduce_output() {
    const auto slots = 1 + steps_.byte() % 20u;
    const int more = (steps_.byte() % 4 - 1) * 4096;
    world_.introduce_output(slots, more, patches());
  }

  // With the truth from now on, everything among the honest ports must add up.
  void finish() {
    Seam::current = nullptr;
    while (!held_.empty()) give_back();
    while (!events_.empty()) give_event_back();
    x_gives_back();
    y_gives_back();
    world_.require_accounts();
  }

  Script& steps_;
  Liar liar_;
  World world_;
  bool s_active_ = false;
  std::uint64_t last_r_ = 0;
  std::uint64_t last_r2_ = 0;
  std::deque<Held> held_;
  std::vector<std::uint32_t> x_holds_;
  bool is_watched_ = false;
  std::uint64_t last_event_ = 0;
  std::deque<detail::TapEventData> events_;  // that have samples
  std::vector<std::uint32_t> y_events_;
};

}  // namespace
}  // namespace arbiter::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using arbiter::fuzz::Script;
  Script steps(data, size / 2);
  Script lies(data + size / 2, size - size / 2);
  arbiter::fuzz::Run(steps, lies).go();
  return 0;
}
