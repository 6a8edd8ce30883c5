// Pictures that no daemon has made.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "top/frame.hpp"
#include "top/view.hpp"

namespace arbiter::top {

inline constexpr shm::Nanoseconds kSecond = 1'000'000'000;

// Two ports, three sources; /object:o wins at /arm:i.
inline Census census_of_robot() {
  Census census;
  census.instance = "robot";
  census.model = "model 1";
  PortFact arm;
  arm.name = "/arm:i";
  arm.component = "arm (pid 7)";
  arm.is_open = arm.is_arbitrated = true;
  arm.rates = PortRates{30, 0, 60};
  arm.waiting = 1;
  arm.depth = 4;
  PortFact gaze = arm;
  gaze.name = "/gaze:i";
  gaze.rates = PortRates{10, 2, 0};
  census.ports = {arm, gaze};
  for (const char* name : {"/face:o", "/object:o", "/rest:o"}) {
    SourceFact source;
    source.name = name;
    source.component = "source (pid 8)";
    source.is_open = true;
    source.timeout = kSecond / 2;
    source.rates = SourceRates{20, 0};
    source.ports = {"/arm:i"};
    census.sources.push_back(source);
  }
  return census;
}

// At that second: /object:o arrived 100 ms ago, /face:o long ago, /rest:o never.
inline Frame frame_at(shm::Nanoseconds second,
                      const std::shared_ptr<const Census>& census =
                          std::make_shared<const Census>(census_of_robot())) {
  Frame frame;
  frame.now = second * kSecond;
  frame.census = census;
  frame.ports = {{1, frame.now - 3 * kSecond, true}, {kNobody, frame.now - kSecond, false}};
  frame.words = {frame.now - kSecond, frame.now + kSecond * 4 / 10, shm::kNeverActive};
  frame.generation = 1;
  return frame;
}

inline std::shared_ptr<const Frame> shared(Frame frame) {
  return std::make_shared<const Frame>(std::move(frame));
}

inline Takeover takeover(std::uint64_t number, const std::string& winner) {
  Takeover result;
  result.number = number;
  result.port = "/arm:i";
  result.winner = winner;
  result.because = winner + " became active";
  return result;
}

}  // namespace arbiter::top
