#pragma once

#include <stdexcept>

namespace arbiter::evidence {

// The file is no recording, or one of a later version: says what and where.
class RecordError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace arbiter::evidence
