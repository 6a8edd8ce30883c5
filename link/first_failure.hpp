// Several steps of which one that fails does not hold up the others.
//
// Thread safety: none of its own.
#pragma once

#include <exception>

#include "link/dds/network.hpp"

namespace arbiter::link {

class FirstFailure {
 public:
  // Takes up DdsError: memory is short, or DDS Security forbids a topic.
  template <class Step>
  void attempt(const Step& step) {
    try {
      step();
    } catch (const DdsError&) {
      if (!error_) error_ = std::current_exception();
    }
  }
  // Throws the first one, if there was any.
  void rethrow() const {
    if (error_) std::rethrow_exception(error_);
  }

 private:
  std::exception_ptr error_;
};

}  // namespace arbiter::link
