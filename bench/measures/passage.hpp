// Samples on their way from a publisher to a subscriber: straight, through a relay, or through a
// gateway of Arbiter. Each is a process of its own.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bench/harness/robot.hpp"
#include "bench/harness/shared.hpp"
#include "bench/harness/worker.hpp"
#include "bench/peers/passing.hpp"

namespace arbiter::bench {

enum class Way { kGateway, kRelay, kDirect };

struct PassageOptions {
  std::size_t bytes = 64;
  // Between two samples, of whatever source. The next one waits until the last has come.
  std::int64_t period_ns = 1'000'000;
  // The first one overrides the others, and never rests: no sample of theirs passes.
  std::size_t sources = 1;
};

class Passage {
 public:
  // When it returns, a sample has come through. Throws where one of the programs cannot be had.
  Passage(Passing& passing, Way way, const PassageOptions& options);

  // From the reading of the clock before publish() to that in the subscriber.
  Histogram round(double seconds);

  // What the processes in between have used, over all rounds.
  struct Use {
    std::string program;
    std::int64_t ns = 0;
  };
  [[nodiscard]] const std::vector<Use>& uses() const { return uses_; }
  [[nodiscard]] std::int64_t used_ns() const;
  [[nodiscard]] std::uint64_t sent() const { return sent_; }
  [[nodiscard]] std::int64_t duration_ns() const { return duration_ns_; }
  // What went wrong but did not end it; empty: nothing.
  [[nodiscard]] std::string remarks() const;

 private:
  // Written by the subscriber, read by the publisher.
  struct Stage {
    std::atomic<std::uint64_t> received{0};  // the number of the last sample
    std::atomic<bool> has_way{false};
  };
  // A gateway, and the daemon that it belongs to.
  struct Arbitration {
    explicit Arbitration(const std::string& model) : robot(model) {}
    Robot robot;
    ScratchDirectory directory;
    Program gateway;
  };

  void start_relay(Passing& passing);
  void start_gateway(const Passing& passing);
  void start_ends(Passing& passing);
  void subscribe(Conversation& with, Passing& passing);
  void publish(Conversation& with, Passing& passing);
  void find_way(PassingPublisher& publisher) const;
  // False: it has not come.
  bool await(std::uint64_t number) const;
  [[nodiscard]] std::string in_topic(std::size_t source) const;
  [[nodiscard]] std::string out_topic() const { return unique_ + "-out"; }
  [[nodiscard]] std::vector<Use> read_uses() const;

  const Way way_;
  const PassageOptions options_;
  const std::string unique_;
  Shared<Stage> stage_;
  std::unique_ptr<Arbitration> arbitration_;
  std::optional<Worker> relay_;
  Worker subscriber_;
  Worker publisher_;
  std::vector<Use> uses_;
  std::uint64_t sent_ = 0;
  std::uint64_t lost_ = 0;
  std::uint64_t strays_ = 0;  // samples of a source that was overridden
  std::int64_t duration_ns_ = 0;
};

}  // namespace arbiter::bench
