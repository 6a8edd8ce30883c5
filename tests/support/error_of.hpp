#pragma once

#include <exception>
#include <string>

namespace arbiter::test {

// What the error says that `act` throws.
template <class Act>
std::string error_of(Act act) {
  try {
    act();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace arbiter::test
