// On which host each source and each port is, for pictures of several hosts.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "drawing/situation.hpp"

namespace arbiter::drawing {

// Each host has a box, with the sources that live there and the ports that it decides.
struct Places {
  struct Box {
    std::vector<std::string> captions;  // lines under its name
    // What it knows itself of who is active and who wins; null: nothing is known of that. Must
    // outlive the drawing.
    const Situation* situation = nullptr;
  };
  std::map<std::string, Box> boxes;            // by host
  std::map<std::string, std::string> sources;  // their hosts; of those without, nobody knows
  std::map<std::string, std::string> ports;    // likewise of input ports
  std::map<std::string, std::string> notes;    // by source: what stands behind its name

  // Empty: in no box.
  [[nodiscard]] std::string host_of_source(const std::string& source) const {
    return host_in(sources, source);
  }
  [[nodiscard]] std::string host_of_port(const std::string& port) const {
    return host_in(ports, port);
  }

 private:
  [[nodiscard]] std::string host_in(const std::map<std::string, std::string>& hosts,
                                    const std::string& name) const {
    const auto found = hosts.find(name);
    return found == hosts.end() || !boxes.contains(found->second) ? std::string() : found->second;
  }
};

}  // namespace arbiter::drawing
