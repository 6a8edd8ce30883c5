// From a component on one host to one on another, through two links, beside plain Cyclone DDS
// between the same two networks: what rules 3 to 5 of docs/hosts.md cost each sample (tokens in its
// header, its order, an arrival at the importing host).
#include <poll.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "bench/harness/hosts.hpp"
#include "bench/harness/shared.hpp"
#include "bench/measures/measures.hpp"
#include "bench/peers/cyclone.hpp"
#include "bench/peers/passing.hpp"
#include "bench/peers/systems.hpp"

namespace arbiter::bench {
namespace {

constexpr const char* kFar = "/Far:o";
constexpr const char* kNear = "/Near:i";
constexpr std::size_t kSmall = 64;
constexpr std::size_t kLarge = std::size_t{1} << 20;
constexpr std::int64_t kPeriodNs = 1'000'000;
constexpr std::int64_t kMs = 1'000'000;

// The number of the last sample that a receiver has, which its sender sees.
using Progress = Shared<std::atomic<std::uint64_t>>;
// So many are on their way at most, in either system: neither waits for its receivers by itself.
constexpr std::uint64_t kOnTheWay = 8;
constexpr std::int64_t kGivenUp = 20 * 1'000'000;  // one that has not come by then is lost

// What has come to a receiver.
class Tally {
 public:
  explicit Tally(const Progress& progress) : progress_(progress) {}
  void add(const Passed& passed) {
    progress_->store(passed.number, std::memory_order_relaxed);
    const auto took = static_cast<double>(now_ns() - passed.sent_ns);
    const std::lock_guard lock(mutex_);
    ns_.add(took);
  }
  // Since the last time.
  Histogram take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(ns_, {});
  }

 private:
  const Progress& progress_;
  std::mutex mutex_;
  Histogram ns_;
};

using Publish = std::function<void(std::size_t bytes, const Passed& passed)>;

// Publishes as it is told: {bytes, period, for how long}; with period 0 as fast as kOnTheWay
// allows.
void be_sender(Conversation& with, const Progress& progress, const Publish& publish) {
  std::uint64_t bytes = 0;
  std::uint64_t number = 0;
  while (with.hear_or_end(bytes)) {
    const auto period = static_cast<std::int64_t>(with.hear());
    const std::int64_t end = now_ns() + static_cast<std::int64_t>(with.hear());
    std::uint64_t sent = 0;
    for (std::int64_t next = now_ns(); now_ns() < end; next += period) {
      const std::int64_t wait = next - now_ns();
      if (period != 0 && wait > 0) {
        const timespec time{0, wait};
        ::nanosleep(&time, nullptr);
      }
      if (period == 0) {
        const std::int64_t lost = now_ns() + kGivenUp;
        while (number - progress->load(std::memory_order_relaxed) >= kOnTheWay && now_ns() < lost) {
          ::sched_yield();
        }
      }
      publish(bytes, {now_ns(), ++number});
      ++sent;
    }
    with.say(sent);
  }
}

void be_receiver(Conversation& with, Tally& tally) {
  std::uint64_t word = 0;
  while (with.hear_or_end(word)) with.say(tally.take());
}

// A sender and a receiver of one system.
class Pair {
 public:
  Pair(std::shared_ptr<Progress> progress, Worker sender, Worker receiver,
       std::vector<Worker> between = {})
      : progress_(std::move(progress)),
        between_(std::move(between)),
        sender_(std::move(sender)),
        receiver_(std::move(receiver)) {}

  // What has come within that time, and a moment after it.
  Histogram send(std::size_t bytes, std::int64_t period, double seconds) {
    receiver_.say(1);
    static_cast<void>(receiver_.hear_histogram());
    sender_.say(bytes);
    sender_.say(static_cast<std::uint64_t>(period));
    sender_.say(static_cast<std::uint64_t>(seconds * 1e9));
    const std::uint64_t sent = sender_.hear();
    ::poll(nullptr, 0, 50);
    receiver_.say(1);
    Histogram came = receiver_.hear_histogram();
    sent_ += sent;
    lost_ += sent - std::min(sent, came.count());
    return came;
  }
  void await() {
    await_in_a_minute("a first sample", [&] { return send(kSmall, kMs, 0.02).count() != 0; });
    sent_ = lost_ = 0;
  }
  // The times are of those that have come: a link throws away what is late. Empty: all have.
  [[nodiscard]] std::string remark() const {
    return lost_ == 0 ? "" : std::to_string(lost_) + " of " + std::to_string(sent_) + " were lost";
  }

 private:
  std::shared_ptr<Progress> progress_;
  std::vector<Worker> between_;
  Worker sender_;
  Worker receiver_;
  std::uint64_t sent_ = 0;
  std::uint64_t lost_ = 0;
};

Pair through_links(const LinkedHost& from, const LinkedHost& to) {
  auto progress = std::make_shared<Progress>();
  Worker sender("sender", [&](Conversation& with) {
    Node node = from.robot().node("sender");
    auto port = node.output_port(kFar, Type::variable("bench/Blob", kLarge));
    be_sender(with, *progress, [&](std::size_t bytes, const Passed& passed) {
      auto loan = port.loan(bytes);
      if (!loan) return;
      std::memcpy(loan->data(), &passed, sizeof passed);
      port.publish(std::move(*loan));
    });
  });
  Worker receiver("receiver", [&](Conversation& with) {
    Node node = to.robot().node("receiver");
    InputPortOptions options;
    options.depth = 16;
    auto port = node.input_port(kNear, options);
    Tally tally(*progress);
    std::atomic<bool> ends{false};
    std::thread taker([&] {
      while (!ends) {
        const auto sample = port.wait_for(std::chrono::milliseconds(20));
        if (!sample) continue;
        Passed passed;
        std::memcpy(&passed, sample->data(), sizeof passed);
        tally.add(passed);
      }
    });
    be_receiver(with, tally);
    ends = true;
    taker.join();
  });
  return {std::move(progress), std::move(sender), std::move(receiver)};
}

Pair plain(const LinkedHost& from, const LinkedHost& to) {
  auto progress = std::make_shared<Progress>();
  Worker sender("Cyclone's sender", [&](Conversation& with) {
    from.space().move_in();
    set_dds_interface("eth0");
    const auto passing = cyclone_passing();
    const auto small = passing->publisher("bench_hosts", kSmall);
    const auto large = passing->publisher("bench_hosts", kLarge);
    be_sender(with, *progress, [&](std::size_t bytes, const Passed& passed) {
      (bytes == kSmall ? small : large)->publish(passed);
    });
  });
  Worker receiver("Cyclone's receiver", [&](Conversation& with) {
    to.space().move_in();
    set_dds_interface("eth0");
    Tally tally(*progress);
    const auto passing = cyclone_passing();
    const auto subscriber =
        passing->subscriber("bench_hosts", [&](const Passed& passed) { tally.add(passed); });
    be_receiver(with, tally);
  });
  return {std::move(progress), std::move(sender), std::move(receiver)};
}

// A pipe that passes samples on, and thereby wakes who waits for them.
class Bell {
 public:
  Bell() {
    if (::pipe(ends_.data()) != 0) throw BenchError("no pipe");
  }
  Bell(const Bell&) = delete;
  Bell& operator=(const Bell&) = delete;
  ~Bell() {
    for (const int end : ends_) ::close(end);
  }
  void pass(const Passed& passed) const {
    if (::write(ends_[1], &passed, sizeof passed) != sizeof passed) {
      throw BenchError("a pipe has broken");
    }
  }
  // Calls `heard` for each sample, and `told` for each word of the conversation, until that ends.
  template <class Heard, class Told>
  void wait(Conversation& with, Heard heard, Told told) const {
    for (std::uint64_t word = 0;;) {
      std::array<pollfd, 2> ends{{{ends_[0], POLLIN, 0}, {with.descriptor(), POLLIN, 0}}};
      static_cast<void>(::poll(ends.data(), ends.size(), -1));
      Passed passed;
      const bool rings = (ends[0].revents & POLLIN) != 0;
      if (rings && ::read(ends_[0], &passed, sizeof passed) == sizeof passed) heard(passed);
      if (rings || ends[1].revents == 0) continue;
      if (!with.hear_or_end(word)) return;
      told();
    }
  }

 private:
  std::array<int, 2> ends_{};
};

// As plain(), but with the wake-ups that links add, where they add them: the sender wakes a process
// that publishes, and who receives wakes the process that has been waiting for the sample.
Pair woken(const LinkedHost& from, const LinkedHost& to) {
  auto progress = std::make_shared<Progress>();
  const auto there = std::make_shared<Bell>();
  const auto here = std::make_shared<Bell>();
  std::vector<Worker> between;
  between.emplace_back("Cyclone's sender, woken", [&](Conversation& with) {
    from.space().move_in();
    set_dds_interface("eth0");
    const auto passing = cyclone_passing();
    const auto publisher = passing->publisher("bench_woken", kSmall);
    there->wait(
        with, [&](const Passed& passed) { publisher->publish(passed); }, [] {});
  });
  between.emplace_back("Cyclone's receiver, waking", [&](Conversation& with) {
    to.space().move_in();
    set_dds_interface("eth0");
    const auto passing = cyclone_passing();
    const auto subscriber =
        passing->subscriber("bench_woken", [&](const Passed& passed) { here->pass(passed); });
    std::uint64_t word = 0;
    while (with.hear_or_end(word)) {
    }
  });
  Worker sender("a sender who wakes", [&](Conversation& with) {
    be_sender(with, *progress,
              [&](std::size_t /*bytes*/, const Passed& passed) { there->pass(passed); });
  });
  Worker receiver("a receiver who is woken", [&](Conversation& with) {
    Tally tally(*progress);
    here->wait(
        with, [&](const Passed& passed) { tally.add(passed); }, [&] { with.say(tally.take()); });
  });
  return {std::move(progress), std::move(sender), std::move(receiver), std::move(between)};
}

// Of a thread that blocks, by another: half of a round trip over two pipes.
class WakeUp {
 public:
  WakeUp() {
    for (auto* const pipe : {&there_, &back_}) {
      if (::pipe(pipe->data()) != 0) throw BenchError("no pipe");
    }
    echo_ = std::thread([this] {
      for (char c = 0; ::read(there_[0], &c, 1) == 1 && ::write(back_[1], &c, 1) == 1;) {
      }
    });
  }
  WakeUp(const WakeUp&) = delete;
  WakeUp& operator=(const WakeUp&) = delete;
  ~WakeUp() {
    ::close(there_[1]);
    echo_.join();
    for (const int end : {there_[0], back_[0], back_[1]}) ::close(end);
  }
  Histogram round(double seconds) {
    Histogram ns;
    const std::int64_t end = now_ns() + static_cast<std::int64_t>(seconds * 1e9);
    for (char c = 'x'; now_ns() < end;) {
      ::poll(nullptr, 0, 1);  // as the samples come: both have gone to sleep
      const std::int64_t before = now_ns();
      if (::write(there_[1], &c, 1) != 1 || ::read(back_[0], &c, 1) != 1) break;
      ns.add(static_cast<double>(now_ns() - before) / 2);
    }
    return ns;
  }

 private:
  std::array<int, 2> there_{};
  std::array<int, 2> back_{};
  std::thread echo_;
};

struct Contest {
  const char* system;
  Role role;
  std::shared_ptr<Pair> pair;
};

// The median of the rounds, which are interleaved as those of run_rounds() are.
Case throughput(const std::vector<Contest>& all, const char* name, std::size_t bytes,
                const Budget& budget) {
  Case result{name};
  result.unit = bytes == kSmall ? "samples/s" : "MB/s";
  std::vector<std::vector<double>> rates(all.size());
  for (int round = 0; round <= budget.rounds; ++round) {
    for (std::size_t n = 0; n < all.size(); ++n) {
      const std::size_t i = (n + static_cast<std::size_t>(round)) % all.size();
      const Histogram got = all[i].pair->send(bytes, 0, budget.seconds_each);
      const double each = bytes == kSmall ? 1 : static_cast<double>(bytes) / 1e6;
      if (round == 0) continue;  // warms up
      rates[i].push_back(static_cast<double>(got.count()) * each / budget.seconds_each);
    }
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    std::nth_element(rates[i].begin(), rates[i].begin() + budget.rounds / 2, rates[i].end());
    result.results.push_back({all[i].system,
                              all[i].role,
                              {},
                              rates[i][static_cast<std::size_t>(budget.rounds / 2)],
                              {}});
  }
  return result;
}

void measure_pairs(Measure& measure, const Budget& budget) {
  NetworkSwitch network;
  LinkedHost head("head", model(declared({kFar})), network);
  LinkedHost base("base", model(behaviour(kFar, kNear, 8)), network);
  head.start_link();
  base.start_link();
  const std::vector<Contest> all{
      {kThroughLinks, Role::kOurs, std::make_shared<Pair>(through_links(head, base))},
      {kCyclone, Role::kPeer, std::make_shared<Pair>(plain(head, base))}};
  std::vector<Contender> contenders;
  for (const Contest& each : all) {
    each.pair->await();
    contenders.push_back({each.system, each.role, [pair = each.pair](double seconds) {
                            return pair->send(kSmall, kPeriodNs, seconds);
                          }});
  }
  const auto with_wake_ups = std::make_shared<Pair>(woken(head, base));
  with_wake_ups->await();
  contenders.push_back({kCycloneWoken, Role::kFloor, [with_wake_ups](double seconds) {
                          return with_wake_ups->send(kSmall, kPeriodNs, seconds);
                        }});
  const auto wake_up = std::make_shared<WakeUp>();
  contenders.push_back(
      {kWakeUp, Role::kFloor, [wake_up](double seconds) { return wake_up->round(seconds); }});
  Case small{kSmallBetweenHosts};
  small.results = run_rounds(std::move(contenders), budget);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (small.results[i].note.empty()) small.results[i].note = all[i].pair->remark();
  }
  measure.cases.push_back(std::move(small));
  measure.cases.push_back(throughput(all, kSmallThroughput, kSmall, budget));
  measure.cases.push_back(throughput(all, kLargeThroughput, kLarge, budget));
}

}  // namespace

Measure measure_hosts_delivery(const Effort& effort) {
  Measure measure{"hosts-delivery", "Between two hosts",
                  "From a component on one host to a component on another, one way, through the "
                  "links of both, beside two programs of Cyclone DDS (reliable, keep last 10) in "
                  "the same two network namespaces, in interleaved rounds: a sample of 64 B each "
                  "millisecond; and as many as pass while at most eight are on their way. "
                  "The rule at the receiver reads eight activities. Through links a sample wakes "
                  "two threads more. What these cost is measured beside it: the same programs of "
                  "Cyclone DDS, but the sender wakes a process that publishes, and who receives "
                  "wakes another; and, by itself, half of a round trip over two pipes between two "
                  "threads of one process, which mostly share a processor."};
  try {
    measure_pairs(measure, effort.quick ? Budget{3, 0.2} : Budget{20, 0.4});
  } catch (const std::exception& error) {
    measure.cases.push_back(
        {kSmallBetweenHosts, {}, {absent(kThroughLinks, Role::kOurs, error.what())}});
  }
  return measure;
}

}  // namespace arbiter::bench
