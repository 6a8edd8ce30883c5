// What is recorded.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include <arbiter/options.hpp>

#include "evidence/records.hpp"
#include "wire/call.hpp"

namespace arbiter::recorder {

struct RecorderOptions {
  // How the instance is joined: by an observer that is asked for a second at most, and by a node.
  wire::Caller caller;
  NodeOptions node;
  // Patterns of input ports, all of whose sources are recorded; empty: all sources that there are.
  std::vector<std::string> ports;
  // "all", "none", or a pattern of sources.
  std::string payloads = "none";
  // How often taps are read.
  evidence::Nanoseconds period = 1'000'000;
  // What may wait for the disk.
  std::size_t queue_bytes = std::size_t{64} << 20;
  // For people, a sentence each; from any thread.
  std::function<void(const std::string&)> say;
};

}  // namespace arbiter::recorder
