// A robot on two hosts: the head has the planner, the base has the motor and what it falls back to.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/link/scene.hpp"

namespace arbiter::test {

struct Speed {
  std::int64_t number;
};

inline constexpr const char* kPlanner = "/Planner/speed:o";
inline constexpr const char* kHold = "/Hold/speed:o";
inline constexpr const char* kMotor = "/Motor/speed:i";

// The motor obeys the planner, and while that is silent it holds.
inline std::string motor_model(const std::string& timeout) {
  return "<behaviors timeout='" + timeout + R"('>
    <behavior name="Hold"><config at="/Motor/speed:i">/Hold/speed:o</config></behavior>
    <behavior name="Drive"><config at="/Motor/speed:i">/Planner/speed:o</config>
      <inhibition>Hold</inhibition></behavior>
  </behaviors>)";
}

// Where the source has its T, and nothing is connected.
inline std::string source_model(const std::string& timeout) {
  return "<behaviors timeout='" + timeout + "'><source port='/Planner/speed:o'/></behaviors>";
}

class Planner {
 public:
  // `published`: where its numbers go on, if it was there before.
  explicit Planner(const Host& host, std::int64_t published = 0, const std::string& node = "brain")
      : node_(host.node(node)), port_(node_.output_port<Speed>(kPlanner)), published_(published) {}
  // Returns the number of the sample.
  std::int64_t publish() {
    port_.publish(Speed{++published_});
    return published_;
  }
  OutputPort<Speed>& port() { return port_; }
  [[nodiscard]] std::int64_t published() const { return published_; }

 private:
  Node node_;
  OutputPort<Speed> port_;
  std::int64_t published_;
};

class Body {
 public:
  explicit Body(const Host& host)
      : node_(host.node("body")),
        hold_(node_.output_port<Speed>(kHold)),
        motor_(node_.input_port<Speed>(kMotor)) {}

  InputPort<Speed>& motor() { return motor_; }
  OutputPort<Speed>& hold() { return hold_; }

  // The planner publishes until the motor has a sample of it, of which the number is returned: each
  // one is larger than all before.
  std::int64_t drive(Planner& planner) {
    for (;;) {
      if (const auto number = commanded_by(planner)) return *number;
    }
  }
  // Whether the motor has a sample of it once it has published another.
  std::optional<std::int64_t> commanded_by(Planner& planner) {
    planner.publish();
    return commanded();
  }
  // Until nothing is left to take, and nobody commands the motor.
  void await_idle() {
    await([&] {
      static_cast<void>(motor_.take());
      return motor_.idle();
    });
  }
  // Until the motor has what it falls back to.
  void fall_back() {
    for (;;) {
      hold_.publish(Speed{0});
      const auto got = motor_.wait_for(5ms);
      if (got && got->source() == kHold) return;
    }
  }

 private:
  std::optional<std::int64_t> commanded() {
    const auto got = motor_.wait_for(5ms);
    if (!got || got->source() != kPlanner) return std::nullopt;
    EXPECT_GT((*got)->number, last_) << "in order, and none twice";
    last_ = (*got)->number;
    return last_;
  }

  Node node_;
  OutputPort<Speed> hold_;
  InputPort<Speed> motor_;
  std::int64_t last_ = 0;
};

}  // namespace arbiter::test
