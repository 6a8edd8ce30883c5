// What calls answer: errors that are thrown, outcomes that are returned.
#pragma once

#include <cstdint>
#include <stdexcept>

namespace arbiter {

// What went wrong, as a sentence.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// What became of one arrival, counted in input ports that are open and connected.
struct Outcome {
  std::uint32_t delivered = 0;  // accepted: the connection is the winner there
  std::uint32_t discarded = 0;  // another connection is, or none
  // It is the winner, but the queue is full (refuse_new); or the connection is refused, because the
  // ports' types differ or memory is short (NoticeKind::refused), and the input port is idle.
  std::uint32_t refused = 0;
};

}  // namespace arbiter
