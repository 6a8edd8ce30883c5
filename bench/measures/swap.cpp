// Models swapped under a publisher that publishes without a pause: does it feel it?
#include <time.h>

#include <array>
#include <atomic>
#include <utility>

#include "bench/harness/cpu.hpp"
#include "bench/harness/interruption.hpp"
#include "bench/harness/robot.hpp"
#include "bench/harness/shared.hpp"
#include "bench/harness/worker.hpp"
#include "bench/measures/measures.hpp"

namespace arbiter::bench {
namespace {

constexpr int kBehaviours = 100;

// The publisher always wins at /swap:i, and in every other model at /mark:i too, so that its
// publish() itself tells when it first meets a new one.
std::string model_where(bool is_marked) {
  std::string marked = behaviour("/swap:o", "/mark:i", 8);
  if (!is_marked) {
    const std::string condition = "<condition>";
    marked.insert(marked.find(condition) + condition.size(), "/never:o and ");
  }
  std::string behaviours = behaviour("/swap:o", "/swap:i", 8) + marked;
  for (int i = 2; i < kBehaviours; ++i) {
    const std::string n = std::to_string(i);
    behaviours += behaviour("/other" + n + ":o", "/other" + n + ":i", 8);
  }
  return model(behaviours);
}

// Read and proved like the others, and refused: two connections can both win.
std::string refused_model() {
  std::string text = model_where(true);
  return text.insert(text.find("</behaviors>"), behaviour("/rival:o", "/swap:i", 8));
}

// How many models the publisher has met. Shared with it.
using Count = Shared<std::atomic<std::uint64_t>>;

struct Gaps {
  Histogram all;
  Histogram first;   // of the publish that first meets a new model
  Histogram before;  // of the one before it
};

void nap(std::int64_t ns) {
  const timespec time{ns / 1'000'000'000, ns % 1'000'000'000};
  ::nanosleep(&time, nullptr);
}

void publish_without_pause(Conversation& with, const Robot& robot, const Count& met) {
  Node node = robot.node("publisher");
  auto output = node.output_port<std::array<std::uint64_t, 8>>("/swap:o");
  const std::array<std::uint64_t, 8> sample{};
  std::uint32_t delivered_before = output.publish(sample).delivered;
  pin(0);
  with.say(1);
  for (std::uint64_t duration = 0; with.hear_or_end(duration);) {
    Gaps gaps;
    std::int64_t before = now_ns();
    const std::int64_t end = before + static_cast<std::int64_t>(duration);
    for (double last_gap = 0; before < end;) {
      const std::uint32_t delivered = output.publish(sample).delivered;
      const std::int64_t now = now_ns();
      const auto gap = static_cast<double>(now - before);
      gaps.all.add(gap);
      if (delivered != delivered_before) {
        gaps.first.add(gap);
        if (last_gap > 0) gaps.before.add(last_gap);
        (*met).fetch_add(1, std::memory_order_relaxed);
        delivered_before = delivered;
      }
      last_gap = gap;
      before = now_ns();
    }
    with.say(gaps.all);
    with.say(gaps.first);
    with.say(gaps.before);
  }
}

class Swaps {
 public:
  Swaps()
      : robot_(model_where(true)),
        receiver_("receiver",
                  [this](Conversation& with) {
                    Node node = robot_.node("receiver");
                    const auto input = node.input_port<std::array<std::uint64_t, 8>>("/swap:i");
                    const auto mark = node.input_port<std::array<std::uint64_t, 8>>("/mark:i");
                    with.say(1);
                    for (std::uint64_t word = 0; with.hear_or_end(word);) {
                    }
                  }),
        publisher_("publisher", [this](Conversation& with) {
          receiver_is_there(with);
          publish_without_pause(with, robot_, met_);
        }) {
    receiver_.hear();
    publisher_.say(1);
    publisher_.hear();
  }

  // Nothing is loaded meanwhile.
  Gaps quiet(double seconds) {
    begin(seconds);
    return end();
  }
  // Models are read, proved and refused, about as often as they are swapped in swapping().
  Gaps refusing(double seconds) {
    const std::int64_t until = begin(seconds);
    while (now_ns() + swap_ns_ < until) {
      robot_.load(refused_model());
      nap(swap_ns_);
    }
    return end();
  }
  Gaps swapping(double seconds) {
    const std::int64_t begun = now_ns();
    const std::int64_t until = begin(seconds);
    const std::uint64_t before = *met_;
    while (now_ns() < until) {
      const std::uint64_t seen = *met_;
      is_marked_ = !is_marked_;
      robot_.load(model_where(is_marked_));
      while (*met_ == seen && now_ns() < until) {
        throw_if_interrupted();
        nap(100'000);
      }
    }
    Gaps gaps = end();
    const std::uint64_t swaps = *met_ - before;
    if (swaps == 0) throw BenchError("no model has come into force");
    swap_ns_ = (now_ns() - begun) / static_cast<std::int64_t>(swaps);
    settle();
    return gaps;
  }

 private:
  static void receiver_is_there(Conversation& with) {
    std::uint64_t word = 0;
    with.hear_or_end(word);
  }
  std::int64_t begin(double seconds) {
    publisher_.say(static_cast<std::uint64_t>(seconds * 1e9));
    return now_ns() + static_cast<std::int64_t>(seconds * 1e9);
  }
  Gaps end() {
    Gaps gaps;
    gaps.all = publisher_.hear_histogram();
    gaps.first = publisher_.hear_histogram();
    gaps.before = publisher_.hear_histogram();
    return gaps;
  }
  // The last model may have come after the publisher's time: what follows begins with the first one
  // in force.
  void settle() {
    is_marked_ = true;
    robot_.load(model_where(true));
    nap(3 * swap_ns_);
    begin(0.001);
    end();
  }

  Robot robot_;
  Count met_;
  bool is_marked_ = true;
  std::int64_t swap_ns_ = 10'000'000;
  Worker receiver_;
  Worker publisher_;
};

}  // namespace

Measure measure_swap(const Effort& effort) {
  Measure measure{
      "swap", "Model swap under load",
      "One component publishes 64 B without a pause, and wins at an input port or two; meanwhile "
      "arbiterd puts one model of 100 behaviours after another in force, as fast as it can. Beside "
      "it, "
      "the same with models that are read, proved and refused (the noise of a daemon that works), "
      "and "
      "with nothing loaded."};
  Swaps swaps;
  Gaps with_swaps;
  Case all{"time of a publish()"};
  const auto round = [&](Gaps (Swaps::*kind)(double)) {
    return [&, kind, is_warm = false](double seconds) mutable {
      const Gaps gaps = (swaps.*kind)(seconds);
      if (std::exchange(is_warm, true)) {  // as run_rounds() counts
        with_swaps.first.add(gaps.first);
        with_swaps.before.add(gaps.before);
      }
      return gaps.all;
    };
  };
  const Budget budget = effort.quick ? Budget{4, 0.5} : Budget{10, 1.5};
  all.results = run_rounds({{"models swapped", Role::kOurs, round(&Swaps::swapping)},
                            {"models refused", Role::kFloor, round(&Swaps::refusing)},
                            {"no models loaded", Role::kFloor, round(&Swaps::quiet)}},
                           budget);
  Case first{"the publish() that first meets a new model"};
  first.results = {{"first under a new model", Role::kOurs, with_swaps.first, {}, {}},
                   {"the one before it", Role::kFloor, with_swaps.before, {}, {}}};
  measure.cases = {std::move(first), std::move(all)};
  return measure;
}

}  // namespace arbiter::bench
