// Publishers, receivers and a daemon in processes of their own, in tiny queues, overriding each
// other at random. Checked, in every take of every receiver:
//   - the sample is whole: its checksum holds, when it is taken and when it is given back;
//   - the samples of a source come in their order, none twice;
//   - nothing of an overridden source is taken by a take that began after the override's publish()
//     had returned and ended before it was deactivated.
// And at the end: what each connection accepted was taken, dropped, overtaken, or waits; and
// publishers have counted the same.
//
//   stress_program [--seconds N] [--seed N] [--kill]
//
// With --kill publishers are killed at random moments instead, and each successor must get through.
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/support/daemon.hpp"

namespace {

using arbiter::InputPort;
using arbiter::Node;
using arbiter::OutputPort;
using arbiter::test::Daemon;

constexpr std::size_t kSources = 4;
constexpr std::size_t kReceivers = 3;

struct Sample {
  std::uint64_t source;
  std::uint64_t number;  // counts the samples of a source, across its publishers
  std::uint64_t publisher;
  std::uint64_t noise[9];
  std::uint64_t checksum;

  [[nodiscard]] std::uint64_t sum() const {
    std::uint64_t result = source * 31 + number * 37 + publisher * 41;
    for (const std::uint64_t word : noise) result = (result ^ word) * 0x9e3779b97f4a7c15;
    return result;
  }
};

using Clock = std::chrono::steady_clock;

// How a run ends: first nobody publishes any more, then all that waits is taken, then ports close.
enum Phase : std::uint64_t { kRunning, kPublishersStop, kReceiversStop, kEnd };

// What the processes tell each other, beside the ports. Each word has one writer at a time.
struct alignas(64) Shared {
  struct alignas(64) Line {
    std::atomic<std::uint64_t> value;
  };
  Line phase;
  Line failures;
  Line surely_active[kSources];  // odd from when a publish() has returned until a deactivate()
                                 // begins
  Line numbers[kSources];
  Line delivered[kSources];
  Line publisher_done[kSources];
  Line receiver_done[kReceivers];
  Line seen_publisher[kReceivers];
  Line takes[kReceivers];
};

Shared& make_shared_memory() {
  void* const memory =
      mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) std::abort();
  return *new (memory) Shared{};
}

std::string source_name(std::size_t source) { return "/source" + std::to_string(source); }
std::string port_name(std::size_t port) { return "/port" + std::to_string(port); }

// At every port each source is overridden by all those after it.
std::string chain_model() {
  std::string model = "<behaviors timeout=\"forever\">";
  for (std::size_t port = 0; port < kReceivers; ++port) {
    model += "<arbiter at=\"" + port_name(port) + "\">";
    for (std::size_t source = 0; source < kSources; ++source) {
      model += "<select from=\"" + source_name(source) + "\">true";
      for (std::size_t other = source + 1; other < kSources; ++other) {
        model += " and not " + source_name(other);
      }
      model += "</select>";
    }
    model += "</arbiter>";
  }
  return model + "</behaviors>";
}

void stay_until(const Shared& shared, Phase phase) {
  while (shared.phase.value.load() < phase) usleep(1'000);
}

void fail(Shared& shared, const std::string& what) {
  std::fprintf(stderr, "FAILED: %s\n", what.c_str());
  shared.failures.value.fetch_add(1);
}

void fill(Sample& sample, std::size_t source, std::uint64_t number, std::uint64_t publisher,
          std::mt19937_64& random) {
  sample.source = source;
  sample.number = number;
  sample.publisher = publisher;
  for (auto& word : sample.noise) word = random();
  sample.checksum = sample.sum();
}

std::uint32_t publish_one(OutputPort<Sample>& port, Shared& shared, std::size_t source,
                          std::uint64_t publisher, std::mt19937_64& random) {
  auto& number = shared.numbers[source].value;
  const std::uint64_t next = number.load(std::memory_order_relaxed) + 1;
  number.store(next, std::memory_order_relaxed);
  if (random() % 2 == 0) {
    if (auto loan = port.loan()) {
      fill(**loan, source, next, publisher, random);
      return port.publish(std::move(*loan)).delivered;
    }
    fail(shared, "no slot to lend");
  }
  Sample sample;
  fill(sample, source, next, publisher, random);
  return port.publish(sample).delivered;
}

// An override is rare, and short; the lowest source is always there.
void publish_at_random(Shared& shared, std::size_t source, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Node node("stress-publisher");
  auto port = node.output_port<Sample>(source_name(source), {.max_loans = 1});
  auto& active = shared.surely_active[source].value;
  std::uint64_t delivered = 0;
  const auto begin = [&] { active.fetch_or(1); };
  while (shared.phase.value.load(std::memory_order_relaxed) == kRunning) {
    for (std::uint64_t i = random() % 20; i-- != 0;) {
      delivered += publish_one(port, shared, source, 0, random);
      begin();
    }
    if (random() % 4 == 0) {
      static_cast<void>(port.signal());
      begin();
    }
    if (source == 0) continue;
    if ((active.load() & 1) != 0) active.fetch_add(1);
    port.deactivate();
    const auto pause = std::chrono::microseconds(random() % (100u << source));
    const auto until = Clock::now() + pause;
    while (Clock::now() < until) {
    }
  }
  shared.delivered[source].value.store(delivered);
  shared.publisher_done[source].value.store(1);
  stay_until(shared, kEnd);
}

class Receiver {
 public:
  Receiver(Shared& shared, std::size_t index, std::uint64_t seed)
      : shared_(shared),
        index_(index),
        random_(seed),
        node_("stress-receiver"),
        max_held_(1 + static_cast<std::uint32_t>(index % 2)),
        port_(node_.input_port<Sample>(
            port_name(index),
            {.depth = 1 + static_cast<std::uint32_t>(index), .max_held = max_held_})) {}

  void run() {
    while (shared_.phase.value.load(std::memory_order_relaxed) < kReceiversStop) take_one();
    while (take_one()) {
    }
    shared_.receiver_done[index_].value.store(1);
    stay_until(shared_, kEnd);
    while (!held_.empty()) give_back();
  }

 private:
  bool take_one() {
    if (held_.size() == max_held_) give_back();
    std::uint64_t before[kSources];
    for (std::size_t i = 0; i < kSources; ++i) before[i] = shared_.surely_active[i].value.load();
    auto sample = port_.take();
    if (!sample && index_ % 2 == 1 && random_() % 16 == 0) {
      auto waited = port_.wait_for(std::chrono::milliseconds(1));
      if (waited) check(*waited);
      return static_cast<bool>(waited);
    }
    if (!sample) return false;
    check(*sample);
    for (std::size_t other = (*sample)->source + 1; other < kSources; ++other) {
      const bool active_all_along =
          (before[other] & 1) != 0 && shared_.surely_active[other].value.load() == before[other];
      if (active_all_along) {
        fail(shared_, port_name(index_) + " took a sample of " + source_name((*sample)->source) +
                          " while " + source_name(other) + " was active");
      }
    }
    held_.push_back(std::move(*sample));
    if (random_() % 2 == 0) give_back();
    return true;
  }

  void check(const arbiter::Sample<Sample>& sample) {
    auto& takes = shared_.takes[index_].value;
    takes.store(takes.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    if (sample->checksum != sample->sum() || sample->source >= kSources) {
      fail(shared_, port_name(index_) + " took a torn sample");
      return;
    }
    if (sample->number <= last_[sample->source]) {
      fail(shared_, port_name(index_) + " took sample " + std::to_string(sample->number) + " of " +
                        source_name(sample->source) + " after sample " +
                        std::to_string(last_[sample->source]));
    }
    last_[sample->source] = sample->number;
    shared_.seen_publisher[index_].value.store(sample->publisher);
  }

  void give_back() {
    if (held_.front()->checksum != held_.front()->sum()) {
      fail(shared_, port_name(index_) + " held a sample that was changed");
    }
    held_.pop_front();
  }

  Shared& shared_;
  std::size_t index_;
  std::mt19937_64 random_;
  Node node_;
  std::uint32_t max_held_;
  InputPort<Sample> port_;
  std::uint64_t last_[kSources] = {};
  std::deque<arbiter::Sample<Sample>> held_;
};

pid_t start(Shared& shared, const std::function<void()>& body) {
  const pid_t child = fork();
  if (child != 0) return child;
  try {
    body();
  } catch (const std::exception& error) {
    fail(shared, error.what());
  }
  _exit(0);
}

void wait_for(Shared& shared, const std::vector<pid_t>& children) {
  for (const pid_t child : children) {
    int status = 0;
    waitpid(child, &status, 0);
    if (status != 0) fail(shared, "a component ended with status " + std::to_string(status));
  }
}

// All children have said that they have come to an end of the phase, or something has failed.
bool wait_for_phase(Shared& shared, const Shared::Line* done, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    while (done[i].value.load() == 0) {
      if (shared.failures.value.load() != 0) return false;
      usleep(1'000);
    }
  }
  return true;
}

// Once nothing moves any more: what a connection has accepted was taken, dropped, overtaken, or
// waits; and its publisher has counted the same.
void check_accounts(Shared& shared, Daemon& daemon) {
  const nlohmann::json status = daemon.status();
  std::uint64_t accepted = 0;
  for (const auto& input : status["inputs"]) {
    for (const auto& connection : input["connections"]) {
      std::uint64_t accounted = 0;
      for (const char* where : {"taken", "dropped", "overtaken", "waiting"}) {
        accounted += connection[where].get<std::uint64_t>();
      }
      accepted += connection["accepted"].get<std::uint64_t>();
      if (connection["accepted"] != accounted) {
        fail(shared, "the account of " + input["name"].get<std::string>() +
                         " does not balance: " + connection.dump());
      }
    }
  }
  std::uint64_t delivered = 0;
  for (const auto& line : shared.delivered) delivered += line.value.load();
  if (accepted != delivered) {
    fail(shared,
         std::to_string(delivered) + " were delivered, " + std::to_string(accepted) + " accepted");
  }
}

int report(const Shared& shared, const char* what, std::uint64_t count) {
  std::uint64_t published = 0, taken = 0;
  for (const auto& line : shared.numbers) published += line.value.load();
  for (const auto& line : shared.takes) taken += line.value.load();
  const std::uint64_t failures = shared.failures.value.load();
  std::printf("%llu published, %llu %s, %llu taken, %llu failures\n",
              static_cast<unsigned long long>(published), static_cast<unsigned long long>(count),
              what, static_cast<unsigned long long>(taken),
              static_cast<unsigned long long>(failures));
  return failures == 0 ? 0 : 1;
}

int stress(std::chrono::seconds duration, std::uint64_t seed) {
  Shared& shared = make_shared_memory();
  Daemon daemon(chain_model());
  std::vector<pid_t> children;
  for (std::size_t i = 0; i < kReceivers; ++i) {
    children.push_back(start(shared, [&] { Receiver(shared, i, seed + i).run(); }));
  }
  for (std::size_t i = 0; i < kSources; ++i) {
    children.push_back(start(shared, [&] { publish_at_random(shared, i, seed + 100 + i); }));
  }
  const auto end = Clock::now() + duration;
  while (Clock::now() < end && shared.failures.value.load() == 0) usleep(10'000);
  shared.phase.value.store(kPublishersStop);
  bool orderly = wait_for_phase(shared, shared.publisher_done, kSources);
  shared.phase.value.store(kReceiversStop);
  orderly = orderly && wait_for_phase(shared, shared.receiver_done, kReceivers);
  if (orderly) check_accounts(shared, daemon);
  shared.phase.value.store(kEnd);
  wait_for(shared, children);
  std::uint64_t delivered = 0;
  for (const auto& line : shared.delivered) delivered += line.value.load();
  for (std::size_t i = 0; i < kReceivers; ++i) {
    if (shared.takes[i].value.load() == 0) fail(shared, port_name(i) + " took nothing");
  }
  return report(shared, "delivered", delivered);
}

// One publisher after the other under the same name, each killed in the middle of what it does.
int kill_publishers(std::chrono::seconds duration, std::uint64_t seed) {
  constexpr std::size_t kKilled = kSources - 1;
  Shared& shared = make_shared_memory();
  Daemon daemon(chain_model());
  std::mt19937_64 random(seed);
  std::vector<pid_t> receivers;
  for (std::size_t i = 0; i < kReceivers; ++i) {
    receivers.push_back(start(shared, [&] { Receiver(shared, i, seed + i).run(); }));
  }
  std::uint64_t publisher = 0;
  const auto end = Clock::now() + duration;
  while (Clock::now() < end && shared.failures.value.load() == 0) {
    ++publisher;
    const pid_t child = start(shared, [&] {
      std::mt19937_64 own(seed + 1000 + publisher);
      Node node("stress-killed");
      auto port = node.output_port<Sample>(source_name(kKilled), {.max_loans = 1});
      for (;;) publish_one(port, shared, kKilled, publisher, own);
    });
    for (const auto& seen : shared.seen_publisher) {
      while (seen.value.load() != publisher && shared.failures.value.load() == 0) usleep(100);
    }
    usleep(static_cast<useconds_t>(random() % 2'000));  // any moment will do
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
  }
  shared.phase.value.store(kReceiversStop);
  wait_for_phase(shared, shared.receiver_done, kReceivers);
  shared.phase.value.store(kEnd);
  wait_for(shared, receivers);
  return report(shared, "killed", publisher);
}

}  // namespace

int main(int argc, char** argv) {
  std::chrono::seconds duration(5);
  std::uint64_t seed = std::random_device{}();
  bool kills = false;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--kill") {
      kills = true;
    } else if (argument == "--seconds" && i + 1 < argc) {
      duration = std::chrono::seconds(std::atoi(argv[++i]));
    } else if (argument == "--seed" && i + 1 < argc) {
      seed = std::strtoull(argv[++i], nullptr, 10);
    } else {
      std::fprintf(stderr, "usage: stress_program [--seconds N] [--seed N] [--kill]\n");
      return 2;
    }
  }
  std::printf("seed %llu\n", static_cast<unsigned long long>(seed));
  std::fflush(stdout);
  try {
    return kills ? kill_publishers(duration, seed) : stress(duration, seed);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "FAILED: %s\n", error.what());
    return 1;
  }
}
