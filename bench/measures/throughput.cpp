// Samples per second, one way, from one process to another.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <memory>

#include "bench/harness/cpu.hpp"
#include "bench/harness/robot.hpp"
#include "bench/harness/worker.hpp"
#include "bench/measures/measures.hpp"
#include "bench/peers/spin.hpp"
#include "bench/peers/systems.hpp"

namespace arbiter::bench {
namespace {

constexpr std::uint64_t kWindow = 8;  // every system's queue is at least that long
constexpr std::uint64_t kAcknowledged = kWindow / 2;

// A sender that has at most a window of samples on their way, and a receiver that acknowledges
// every fourth.
void send_in_window(Endpoint& endpoint, std::uint64_t times) {
  std::uint64_t done = 0;
  for (std::uint64_t number = 1; number <= times; ++number) {
    while (number - done > kWindow) done = endpoint.receive();
    endpoint.send(number);
  }
  while (done != times) done = endpoint.receive();
}

void receive_and_acknowledge(Endpoint& endpoint, std::uint64_t times) {
  for (std::uint64_t number = 1; number <= times; ++number) {
    const std::uint64_t heard = endpoint.receive();
    if (heard != number) {
      throw BenchError("sample " + std::to_string(heard) + " has come in place of " +
                       std::to_string(number));
    }
    if (number % kAcknowledged == 0) endpoint.send(number);
  }
}

// Two workers of which each round sends so many samples as fill its time.
class Flood {
 public:
  using Ends = std::function<void(Conversation& with)>;
  // Each end answers a number of samples, when it is done, with the nanoseconds that one took.
  Flood(const std::string& name, const Ends& receiver, const Ends& sender)
      : receiver_(name + ", receiver", receiver), sender_(name + ", sender", sender) {
    receiver_.hear();
    sender_.hear();
  }

  Histogram round(double seconds) {
    double ns = once(kFirst);
    ns = once(std::max(kFirst, rounded(seconds * 1e9 / std::max(1.0, ns))));
    Histogram result;
    result.add(ns);
    return result;
  }

 private:
  static constexpr std::uint64_t kFirst = 400;
  static std::uint64_t rounded(double times) {
    return static_cast<std::uint64_t>(times) / kAcknowledged * kAcknowledged;
  }
  double once(std::uint64_t times) {
    receiver_.say(times);
    receiver_.hear();
    sender_.say(times);
    const auto picoseconds = static_cast<double>(receiver_.hear());
    sender_.hear();
    return picoseconds / 1000;
  }

  Worker receiver_;
  Worker sender_;
};

std::uint64_t picoseconds_each(std::int64_t ns, std::uint64_t times) {
  return static_cast<std::uint64_t>(1000.0 * static_cast<double>(ns) / static_cast<double>(times));
}

Contender windowed(System& system, Exchange exchange) {
  exchange.unique = "arbiter-bench-" + std::to_string(::getpid()) + "-flood-" + system.name();
  for (char& c : exchange.unique) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '-';
  }
  std::shared_ptr<Session> session = system.prepare(exchange);
  auto flood = std::make_shared<Flood>(
      system.name(),
      [session](Conversation& with) {
        const auto endpoint = session->open(Side::kResponder);
        pin(1);
        with.say(1);
        for (std::uint64_t times = 0; with.hear_or_end(times);) {
          with.say(1);
          const std::int64_t before = now_ns();
          receive_and_acknowledge(*endpoint, times);
          with.say(picoseconds_each(now_ns() - before, times));
        }
      },
      [session](Conversation& with) {
        const auto endpoint = session->open(Side::kInitiator);
        pin(0);
        with.say(1);
        for (std::uint64_t times = 0; with.hear_or_end(times);) {
          send_in_window(*endpoint, times);
          with.say(1);
        }
      });
  return {system.name(), system.role(),
          [session, flood](double seconds) { return flood->round(seconds); }};
}

using Sample64 = std::array<std::uint64_t, 8>;

// What of an Arbiter flood is counted.
enum class Counted { kPublished, kTaken };

Contender flat_out(const std::string& name, WhenFull when_full, Counted counted) {
  auto robot = std::make_shared<Robot>(model(behaviour("/flood:o", "/flood:i", 8)));
  auto flood = std::make_shared<Flood>(
      name,
      [robot, when_full, counted](Conversation& with) {
        Node node = robot->node("receiver");
        InputPortOptions options;
        options.depth = 1024;
        options.when_full = when_full;
        auto input = node.input_port<Sample64>("/flood:i", options);
        pin(1);
        with.say(1);
        for (std::uint64_t times = 0; with.hear_or_end(times);) {
          with.say(1);
          std::int64_t first = 0;
          std::uint64_t last = 0;
          std::uint64_t taken = 0;
          spin_until([&] {
            const auto sample = input.take();
            if (!sample) return false;
            const std::uint64_t number = (**sample)[0];
            const bool is_next = when_full == refuse_new ? number == last + 1 : number > last;
            if (!is_next)
              throw BenchError("sample " + std::to_string(number) + " after " +
                               std::to_string(last));
            last = number;
            if (taken++ == 0) first = now_ns();
            return number == times;
          });
          const std::int64_t spent = now_ns() - first;
          with.say(picoseconds_each(spent, counted == Counted::kTaken ? taken : times));
        }
      },
      [robot](Conversation& with) {
        Node node = robot->node("publisher");
        auto output = node.output_port<Sample64>("/flood:o");
        pin(0);
        with.say(1);
        Sample64 sample{};
        for (std::uint64_t times = 0; with.hear_or_end(times);) {
          for (sample[0] = 1; sample[0] <= times;) {
            if (output.publish(sample).refused == 0) ++sample[0];
          }
          with.say(1);
        }
      });
  return {name, Role::kOurs, [robot, flood](double seconds) { return flood->round(seconds); }};
}

// The rounds' median, as samples per second.
Case rates(std::string name, std::vector<Contender> contenders, const Effort& effort) {
  Case one{std::move(name)};
  one.results = run_rounds(std::move(contenders), effort.quick ? Budget{5, 0.04} : Budget{15, 0.1});
  for (Result& result : one.results) {
    if (result.ns.count() != 0) result.value = 1e9 / result.ns.quantile(0.5);
    result.ns = {};
  }
  return one;
}

}  // namespace

Measure measure_throughput(const Effort& effort) {
  Measure measure{"throughput", "Throughput",
                  "64 B one way from process to process, both spinning: in a window of 8 samples, "
                  "of which every "
                  "fourth is acknowledged, as every system can; and Arbiter alone without "
                  "acknowledgements, with a "
                  "queue of 1024, which refuses what does not fit or drops the oldest."};
  measure.unit = "1/s";
  const Systems systems = all_systems();
  for (const Waiting waiting : {Waiting::kSpinning, Waiting::kBlocking}) {
    const Exchange exchange{waiting, 64, {}};
    std::vector<Contender> contenders;
    std::vector<Result> absent_ones;
    for (const auto& system : systems) {
      // The floors hold one word, or bytes without borders.
      if (system->role() == Role::kFloor || !system->can(exchange)) continue;
      try {
        contenders.push_back(windowed(*system, exchange));
      } catch (const std::exception& error) {
        absent_ones.push_back(absent(system->name(), system->role(), error.what()));
      }
    }
    Case one =
        rates(waiting == Waiting::kSpinning ? "window of 8, spinning" : "window of 8, blocking",
              std::move(contenders), effort);
    one.results.insert(one.results.end(), absent_ones.begin(), absent_ones.end());
    measure.cases.push_back(std::move(one));
  }
  measure.cases.push_back(
      rates("without acknowledgements",
            {flat_out("arbiter, refuse_new", refuse_new, Counted::kTaken),
             flat_out("arbiter, drop_oldest: published", drop_oldest, Counted::kPublished),
             flat_out("arbiter, drop_oldest: taken", drop_oldest, Counted::kTaken)},
            effort));
  return measure;
}

}  // namespace arbiter::bench
