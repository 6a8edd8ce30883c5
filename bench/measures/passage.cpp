#include "bench/measures/passage.hpp"

#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iterator>
#include <mutex>
#include <thread>
#include <utility>

#include "bench/harness/cpu.hpp"

namespace arbiter::bench {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kPatience = kSecond;             // for one sample
constexpr std::int64_t kPatienceForWay = 30 * kSecond;  // discovery, on a machine that is busy
constexpr int kMostLost = 3;                            // in a row

std::string unique_name() {
  static int passages = 0;
  return "arbiter-bench-" + std::to_string(::getpid()) + "-passage" + std::to_string(++passages);
}

std::string source_port(std::size_t source) { return "/from" + std::to_string(source) + ":o"; }
constexpr const char* kPort = "/to:i";

// One source: its rule reads eight activities, as elsewhere in the benchmark. Several: each
// inhibits those behind it.
std::string model_of(std::size_t sources) {
  if (sources == 1) return model(behaviour(source_port(0), kPort, 8));
  std::string behaviours;
  for (std::size_t i = 0; i < sources; ++i) {
    behaviours += "<behavior name=\"Command" + std::to_string(i) + "\"><config at=\"" + kPort +
                  "\">" + source_port(i) + "</config>";
    for (std::size_t weaker = i + 1; weaker < sources; ++weaker) {
      behaviours += "<inhibition>Command" + std::to_string(weaker) + "</inhibition>";
    }
    behaviours += "</behavior>\n";
  }
  return model(behaviours);
}

void sleep_until(std::int64_t time_ns) {
  const timespec time{time_ns / kSecond, time_ns % kSecond};
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, nullptr) == EINTR) {
  }
}

std::string content_of(const std::string& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace

Passage::Passage(Passing& passing, Way way, const PassageOptions& options)
    : way_(way), options_(options), unique_(unique_name()) {
  if (way == Way::kGateway) start_gateway(passing);
  if (way == Way::kRelay) start_relay(passing);
  try {
    start_ends(passing);
  } catch (const BenchError& error) {
    if (arbitration_ == nullptr) throw;
    throw BenchError(std::string(error.what()) +
                     "; the gateway: " + content_of(arbitration_->directory.path() + "/log") +
                     arbitration_->robot.log());
  }
}

// Where nothing is in between, there is one topic.
std::string Passage::in_topic(std::size_t source) const {
  return way_ == Way::kDirect ? out_topic() : unique_ + "-in" + std::to_string(source);
}

void Passage::start_relay(Passing& passing) {
  relay_.emplace("relay", [&](Conversation& with) {
    std::vector<std::string> from;
    for (std::size_t i = 0; i < options_.sources; ++i) from.push_back(in_topic(i));
    const auto relay = passing.relay(from, out_topic());
    with.say(1);
    std::uint64_t word = 0;
    while (with.hear_or_end(word)) {
    }
  });
  relay_->hear();
}

void Passage::start_gateway(const Passing& passing) {
  const std::string program = program_directory() + "/" + passing.gateway();
  if (::access(program.c_str(), X_OK) != 0) throw BenchError("there is no " + program);
  arbitration_ = std::make_unique<Arbitration>(model_of(options_.sources));
  const std::string mapping = arbitration_->directory.path() + "/mapping.xml";
  std::vector<Passing::Port> in;
  for (std::size_t i = 0; i < options_.sources; ++i) in.push_back({in_topic(i), source_port(i)});
  std::ofstream(mapping) << passing.mapping(in, {out_topic(), kPort});
  Program::Variables variables = passing.variables();
  variables["XDG_RUNTIME_DIR"] = arbitration_->robot.runtime_directory();
  arbitration_->gateway = Program({program, mapping, "--instance", Robot::kInstance}, variables,
                                  arbitration_->directory.path() + "/log");
}

void Passage::start_ends(Passing& passing) {
  subscriber_ = Worker("subscriber", [&](Conversation& with) { subscribe(with, passing); });
  subscriber_.hear();
  publisher_ = Worker("publisher", [&](Conversation& with) { publish(with, passing); });
  publisher_.hear();
}

// Answers each word with what has come since the last one, and the number of strays.
void Passage::subscribe(Conversation& with, Passing& passing) {
  std::mutex mutex;
  Histogram times;
  std::uint64_t strays = 0;
  const auto subscriber = passing.subscriber(out_topic(), [&](const Passed& sample) {
    const std::int64_t now = now_ns();
    if (sample.number == 0) {
      stage_->has_way = true;
      return;
    }
    const std::lock_guard lock(mutex);
    if ((sample.number - 1) % options_.sources != 0) {
      ++strays;
      return;
    }
    times.add(static_cast<double>(now - sample.sent_ns));
    stage_->received.store(sample.number, std::memory_order_release);
  });
  with.say(1);
  for (std::uint64_t word = 0; with.hear_or_end(word);) {
    const std::lock_guard lock(mutex);
    with.say(std::exchange(times, {}));
    with.say(std::exchange(strays, 0));
  }
}

void Passage::find_way(PassingPublisher& publisher) const {
  const std::int64_t deadline = now_ns() + kPatienceForWay;
  while (!stage_->has_way) {
    const std::int64_t now = now_ns();
    if (now > deadline) throw BenchError("no sample has come through for half a minute");
    publisher.publish({now, 0});
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

bool Passage::await(std::uint64_t number) const {
  const std::int64_t deadline = now_ns() + kPatience;
  while (stage_->received.load(std::memory_order_acquire) < number) {
    if (now_ns() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::microseconds(50));
  }
  return true;
}

void Passage::publish(Conversation& with, Passing& passing) {
  std::vector<std::unique_ptr<PassingPublisher>> publishers;
  for (std::size_t i = 0; i < options_.sources; ++i) {
    publishers.push_back(passing.publisher(in_topic(i), options_.bytes));
  }
  find_way(*publishers.front());
  with.say(1);
  std::uint64_t number = 0;
  std::uint64_t expected = 0;  // the last one that must come
  for (std::uint64_t times = 0; with.hear_or_end(times);) {
    std::int64_t next = now_ns();
    int lost_in_a_row = 0;
    for (; times != 0; --times) {
      sleep_until(next);
      const std::size_t source = number % options_.sources;
      publishers[source]->publish({now_ns(), ++number});
      if (source == 0) expected = number;
      next = std::max(next + options_.period_ns, now_ns());
      lost_in_a_row = await(expected) ? 0 : lost_in_a_row + 1;
      if (lost_in_a_row == kMostLost) throw BenchError("samples do not come through any more");
    }
    with.say(1);
  }
}

std::vector<Passage::Use> Passage::read_uses() const {
  std::vector<Use> uses;
  if (relay_) uses.push_back({"relay", processor_time_ns(relay_->pid())});
  if (arbitration_ == nullptr) return uses;
  const Program& gateway = arbitration_->gateway;
  const std::vector<pid_t> workers = gateway.children();
  uses.push_back({workers.empty() ? "gateway" : "supervisor", processor_time_ns(gateway.pid())});
  for (const pid_t worker : workers) uses.push_back({"gateway", processor_time_ns(worker)});
  uses.push_back({"arbiterd", processor_time_ns(arbitration_->robot.daemon())});
  return uses;
}

Histogram Passage::round(double seconds) {
  const auto periods =
      static_cast<std::uint64_t>(seconds * 1e9 / static_cast<double>(options_.period_ns));
  const std::uint64_t passing = std::max<std::uint64_t>(1, periods / options_.sources);
  const std::uint64_t times = passing * options_.sources;
  const std::vector<Use> before = read_uses();
  const std::int64_t begin = now_ns();
  publisher_.say(times);
  publisher_.hear();
  duration_ns_ += now_ns() - begin;
  std::vector<Use> after = read_uses();
  if (after.size() != before.size()) throw BenchError("the gateway has begun again");
  uses_.resize(after.size());
  for (std::size_t i = 0; i < after.size(); ++i) {
    uses_[i].program = after[i].program;
    uses_[i].ns += after[i].ns - before[i].ns;
  }
  subscriber_.say(1);
  Histogram seen = subscriber_.hear_histogram();
  strays_ += subscriber_.hear();
  sent_ += times;
  lost_ += passing - std::min(passing, seen.count());
  return seen;
}

std::int64_t Passage::used_ns() const {
  std::int64_t sum = 0;
  for (const Use& each : uses_) sum += each.ns;
  return sum;
}

std::string Passage::remarks() const {
  std::string text;
  if (lost_ != 0) text = std::to_string(lost_) + " of " + std::to_string(sent_) + " were lost";
  if (strays_ != 0) {
    text += (text.empty() ? "" : "; ") + std::to_string(strays_) +
            " of a source that was overridden have passed";
  }
  return text;
}

}  // namespace arbiter::bench
