#pragma once

#include <cstdint>
#include <string>

namespace arbiter::cli {

struct WhyOptions {
  std::string port;
  std::string source;
  std::string instance;
  std::string host;  // empty: the one that has the port open
  bool follow = false;
  bool all = false;
  bool json = false;
  std::uint64_t count = 0;  // of changes; 0: until interrupted
};

}  // namespace arbiter::cli
