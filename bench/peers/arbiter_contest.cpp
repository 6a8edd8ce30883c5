#include <array>
#include <chrono>

#include "bench/harness/robot.hpp"
#include "bench/harness/worker.hpp"
#include "bench/peers/contest.hpp"

namespace arbiter::bench {
namespace {

// The old winner's rule reads eight activities besides its own: the override's and seven others.
std::string contest_model(const Contest& contest) {
  return model(
      "<behavior name=\"Old\"><config at=\"/contest:i\">/old:o</config>"
      "<condition>not (/s1:o or /s2:o or /s3:o or /s4:o or /s5:o or /s6:o or /s7:o)</condition>"
      "</behavior>\n"
      "<behavior name=\"Override\"><config at=\"/contest:i\">/override:o</config>"
      "<inhibition>Old</inhibition></behavior>\n",
      std::to_string(contest.timeout_ns) + "ns");
}

class ArbiterSources : public Sources {
 public:
  explicit ArbiterSources(Node node)
      : node_(std::move(node)),
        ports_{node_.output_port<ContestSample>("/old:o"),
               node_.output_port<ContestSample>("/override:o")} {}

  void publish(Party party, std::uint64_t number) override {
    auto& port = ports_[static_cast<std::size_t>(party)];
    auto loan = port.loan();
    if (!loan) throw BenchError("no memory for a sample");
    (*loan)->party = static_cast<std::uint64_t>(party);
    (*loan)->number = number;
    port.publish(std::move(*loan));
  }
  void release() override { ports_[static_cast<std::size_t>(Party::kOverride)].deactivate(); }

 private:
  Node node_;
  std::array<OutputPort<ContestSample>, 2> ports_;
};

class ArbiterDestination : public Destination {
 public:
  explicit ArbiterDestination(Node node)
      : node_(std::move(node)), port_(node_.input_port<ContestSample>("/contest:i")) {}

  Taken take() override {
    const auto sample = port_.take();
    return sample ? taken(**sample) : Taken{};
  }
  Taken wait() override {
    const auto result = port_.wait_for(std::chrono::seconds(1));
    if (result) return taken(**result);
    return {result.idle() ? Taken::Kind::kIdle : Taken::Kind::kNothing};
  }

 private:
  Node node_;
  InputPort<ContestSample> port_;
};

class ArbiterContest : public ContestSession {
 public:
  explicit ArbiterContest(const Contest& contest) : robot_(contest_model(contest)) {}

  std::unique_ptr<Sources> open_sources() override {
    return std::make_unique<ArbiterSources>(robot_.node("sources"));
  }
  std::unique_ptr<Destination> open_destination() override {
    return std::make_unique<ArbiterDestination>(robot_.node("destination"));
  }

 private:
  Robot robot_;
};

}  // namespace

std::unique_ptr<ContestSession> arbiter_contest(const Contest& contest) {
  return std::make_unique<ArbiterContest>(contest);
}

}  // namespace arbiter::bench
