// Whether all that was counted adds up, once nothing moves any more.
//
// Two witnesses: the segments of all ports, mapped read-only while their processes live and kept
// when they die; and the daemon's status document.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/stress/plan.hpp"
#include "tests/stress/records.hpp"
#include "tests/support/segments.hpp"

namespace arbiter::stress {

using PortIds = std::map<std::string, std::uint32_t>;  // by name of the input port

class Accounts {
 public:
  Accounts(const Plan& plan, const Records& records) : plan_(plan), records_(records) {}

  // Maps the segments of a process that has just opened its ports.
  void watch(std::uint32_t component, pid_t process);

  // What does not add up, by the segments: for every receiver that lived all the time, and every
  // publisher that lives.
  [[nodiscard]] std::vector<std::string> errors_in_segments(const PortIds& ids) const;
  // The same by the status document. `all_open`: no port came or went while samples were published.
  [[nodiscard]] std::vector<std::string> errors_in_status(const nlohmann::json& status,
                                                          bool all_open) const;
  // Decisions that could not be taken, of those that live.
  [[nodiscard]] std::uint64_t undecided() const;

 private:
  struct Output {
    std::uint32_t component;
    test::OwnOutput own;
  };
  struct Input {
    std::uint32_t component;
    test::OwnInput own;
  };
  [[nodiscard]] const Output* living_output(std::uint32_t component) const;

  const Plan& plan_;
  const Records& records_;
  std::vector<Output> outputs_;
  std::vector<Input> inputs_;
};

}  // namespace arbiter::stress
