// What all gateway programs have in common: options, the mapping, signals, messages, exit codes.
//
//   int main(int argc, char** argv) {
//     using namespace arbiter::gateway;
//     return run_program(argc, argv, {Kind::kDds, "arbiter-gateway-dds", "…", "…"},
//                        [](const Settings& settings, const Bell& bell) { … });
//   }
//
// Exit codes: 0 ended by SIGINT or SIGTERM, or the mapping is fine (--check); 1 what went wrong has
// been said; 2 wrong use, or a mapping with errors.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "gateway/core/bridge.hpp"
#include "gateway/core/middleware.hpp"
#include "gateway/core/settings.hpp"
#include "gateway/mapping/mapping.hpp"

namespace arbiter::gateway {

struct ProgramKind {
  Kind kind;
  std::string name;   // "arbiter-gateway-dds"
  std::string about;  // a line of --help
  std::string more;   // the end of --help: an example, what the middleware needs
  // Whether what talks to the middleware is a process of its own, which a supervisor starts again
  // when it ends or hangs (supervisor.hpp): for a library that ends its process.
  bool is_supervised = false;
  // What a worker that has ended may have left behind; called with its process's id.
  std::function<void(int)> clean_up = [](int) {};
};

// The bell rings the loop; it outlives the middleware.
using MakeMiddleware =
    std::function<std::unique_ptr<Middleware>(const Settings& settings, const Bell& bell)>;

// The whole of main().
int run_program(int argc, char** argv, const ProgramKind& kind, const MakeMiddleware& make);

}  // namespace arbiter::gateway
