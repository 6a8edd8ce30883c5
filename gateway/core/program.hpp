// What all gateway programs have in common: options, the mapping, signals, messages, exit codes.
//
//   int main(int argc, char** argv) {
//     return gateway::run_program(argc, argv, {gateway::Kind::kDds, "arbiter-gateway-dds", "…"},
//                                 [](const gateway::Settings& settings) { … });
//   }
//
// Exit codes: 0 ended by SIGINT or SIGTERM, or the mapping is fine (--check); 1 what went wrong has
// been said; 2 wrong use, or a mapping with errors.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/core/bridge.hpp"
#include "gateway/core/middleware.hpp"
#include "gateway/mapping/mapping.hpp"

namespace arbiter::gateway {

struct ProgramKind {
  Kind kind;
  std::string name;   // "arbiter-gateway-dds"
  std::string about;  // a line of --help
  std::string more;   // the end of --help: an example, what the middleware needs
};

// What the command line and the mappings say.
struct Settings {
  std::vector<Mapping> mappings;  // checked: no errors
  BridgeOptions bridge;
};

using MakeMiddleware = std::function<std::unique_ptr<Middleware>(
    const Settings& settings, const std::function<void()>& wake)>;

// `run_with` has the default; a program that needs more around the loop gives its own.
int run_program(int argc, char** argv, const ProgramKind& kind, const MakeMiddleware& make);

enum class Level { kError, kWarning, kInfo };
// A line on standard error, for people or for the journal (which is told the level); control
// characters are escaped. Any thread.
void say(Level level, std::string_view text);

}  // namespace arbiter::gateway
