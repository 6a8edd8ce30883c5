#include <chrono>
#include <cstring>

#include "bench/harness/robot.hpp"
#include "bench/peers/spin.hpp"
#include "bench/peers/systems.hpp"

namespace arbiter::bench {
namespace {

class ArbiterEndpoint : public Endpoint {
 public:
  ArbiterEndpoint(Node node, const Exchange& exchange, Side side)
      : node_(std::move(node)),
        exchange_(exchange),
        output_(node_.output_port(side == Side::kInitiator ? "/ping:o" : "/pong:o", output())),
        input_(node_.input_port(side == Side::kInitiator ? "/pong:i" : "/ping:i")) {}

  void send(std::uint64_t number) override {
    auto loan = output_.loan(exchange_.bytes);
    if (!loan) throw BenchError("no memory for a sample");
    std::memcpy(loan->data(), &number, sizeof number);
    output_.publish(std::move(*loan));
  }

  std::uint64_t receive() override {
    if (exchange_.waiting == Waiting::kBlocking) return receive_blocking();
    std::uint64_t number = 0;
    spin_until([&] {
      const auto sample = input_.take();
      if (!sample) return false;
      std::memcpy(&number, sample->data(), sizeof number);
      return true;
    });
    return number;
  }

 private:
  [[nodiscard]] OutputPortOptions output() const {
    OutputPortOptions options;
    options.max_size = exchange_.bytes;
    return options;
  }

  std::uint64_t receive_blocking() {
    for (;;) {
      const auto result = input_.wait_for(std::chrono::seconds(10));
      if (result.timed_out()) throw BenchError("no sample has come for ten seconds");
      if (result.idle()) continue;  // others were measured for longer than the source stays active
      std::uint64_t number = 0;
      std::memcpy(&number, result->data(), sizeof number);
      return number;
    }
  }

  Node node_;
  Exchange exchange_;
  OutputPort<> output_;
  InputPort<> input_;
};

class ArbiterSession : public Session {
 public:
  ArbiterSession(const Exchange& exchange, int sensed)
      : exchange_(exchange),
        robot_(model(behaviour("/ping:o", "/ping:i", sensed) +
                     behaviour("/pong:o", "/pong:i", sensed))) {}

  std::unique_ptr<Endpoint> open(Side side) override {
    return std::make_unique<ArbiterEndpoint>(
        robot_.node(side == Side::kInitiator ? "initiator" : "responder"), exchange_, side);
  }

 private:
  Exchange exchange_;
  Robot robot_;
};

class ArbiterSystem : public System {
 public:
  ArbiterSystem(std::string name, int sensed) : name_(std::move(name)), sensed_(sensed) {}

  [[nodiscard]] std::string name() const override { return name_; }
  [[nodiscard]] Role role() const override { return Role::kOurs; }
  [[nodiscard]] bool can(const Exchange&) const override { return true; }
  std::unique_ptr<Session> prepare(const Exchange& exchange) override {
    return std::make_unique<ArbiterSession>(exchange, sensed_);
  }

 private:
  std::string name_;
  int sensed_;
};

}  // namespace

std::unique_ptr<System> arbiter_system() { return std::make_unique<ArbiterSystem>(kArbiter, 8); }
std::unique_ptr<System> arbiter_without_rules() {
  return std::make_unique<ArbiterSystem>("arbiter, no rule to decide", 0);
}

}  // namespace arbiter::bench
