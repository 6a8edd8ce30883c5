#pragma once

#include <vector>

#include "gateway/core/bridge.hpp"
#include "gateway/mapping/mapping.hpp"

namespace arbiter::gateway {

// What the command line and the mappings say.
struct Settings {
  std::vector<Mapping> mappings;  // checked: no errors
  BridgeOptions bridge;
};

}  // namespace arbiter::gateway
