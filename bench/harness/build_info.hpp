// What the benchmark was built from, and how.
#pragma once

#include <string>
#include <vector>

namespace arbiter::bench {

struct BuildInfo {
  std::string version;  // Arbiter's
  std::string commit;   // of git, with "-dirty" where files were changed; empty outside git
  std::string compiler;
  std::string type;   // CMake's build type
  std::string flags;  // of the compiler
  bool is_optimised = false;
  std::string sanitizer;               // empty: none
  std::vector<std::string> libraries;  // as loaded: "libzmq.so.5.2.4"
};

BuildInfo build_info();

}  // namespace arbiter::bench
