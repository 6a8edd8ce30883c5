#pragma once

#include <stdexcept>

namespace arbiter::watch {

// What was asked for is not there: the message says what is.
class WatchError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace arbiter::watch
