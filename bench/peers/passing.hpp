// A sample on its way from a publisher to a subscriber of some middleware. Neither knows what is in
// between: nothing, a relay that takes and publishes, or a gateway of Arbiter.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bench/harness/program.hpp"

namespace arbiter::bench {

// What a sample begins with. The rest is neither written nor read by the two ends.
struct Passed {
  std::int64_t sent_ns = 0;  // by CLOCK_MONOTONIC
  std::uint64_t number = 0;
};
// Called by a thread of the subscriber's.
using OnPassed = std::function<void(const Passed&)>;

// What is made of a middleware in a worker lives until it is destroyed.
class PassingEnd {
 public:
  PassingEnd() = default;
  PassingEnd(const PassingEnd&) = delete;
  PassingEnd& operator=(const PassingEnd&) = delete;
  virtual ~PassingEnd() = default;
};

class PassingPublisher : public PassingEnd {
 public:
  virtual void publish(const Passed& sample) = 0;
};

// All names of topics of one passage begin with what no other one has.
class Passing {
 public:
  Passing() = default;
  Passing(const Passing&) = delete;
  Passing& operator=(const Passing&) = delete;
  virtual ~Passing() = default;

  // In a worker of its own, each.
  virtual std::unique_ptr<PassingPublisher> publisher(const std::string& topic,
                                                      std::size_t bytes) = 0;
  virtual std::unique_ptr<PassingEnd> subscriber(const std::string& topic, OnPassed on_passed) = 0;
  // Takes from one topic and publishes on another, as well as the middleware allows. Of several
  // topics to take from, the first has the highest priority, as with twist_mux: what comes from
  // another one passes unless a higher one has been heard within the last kSilent.
  static constexpr std::int64_t kSilentNs = 500'000'000;
  virtual std::unique_ptr<PassingEnd> relay(const std::vector<std::string>& from,
                                            const std::string& to) = 0;

  // The gateway's program, the environment that it is started in, and its mapping: from each of the
  // topics to an output port, and from an input port to another topic.
  [[nodiscard]] virtual std::string gateway() const = 0;
  [[nodiscard]] virtual Program::Variables variables() const { return {}; }
  struct Port {
    std::string topic;
    std::string port;
  };
  [[nodiscard]] virtual std::string mapping(const std::vector<Port>& in, const Port& out) const = 0;
};

// Before the workers are made. Throws where the middleware is not to be had on this machine.
std::unique_ptr<Passing> iceoryx_passing();
std::unique_ptr<Passing> cyclone_passing();
// Commands of ROS 2: geometry_msgs/msg/Twist, whatever size is asked for.
std::unique_ptr<Passing> twist_passing();

}  // namespace arbiter::bench
