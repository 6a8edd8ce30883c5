// What a host says of itself.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "link/core/host_card.hpp"

namespace arbiter::test {

inline link::HostCard host_card(const std::string& host, link::Incarnation incarnation,
                                std::vector<std::string> inputs = {},
                                std::vector<std::string> outputs = {}) {
  link::HostCard card;
  card.incarnation = incarnation;
  card.host = host;
  card.instance = "default";
  card.version = "1.2";
  card.has_daemon = true;
  card.generation = 3;
  card.digest = 7;
  card.model = "patrol";
  card.imports = 1;
  card.input_count = static_cast<std::uint32_t>(inputs.size());
  card.output_count = static_cast<std::uint32_t>(outputs.size());
  card.inputs = std::move(inputs);
  card.outputs = std::move(outputs);
  return card;
}

}  // namespace arbiter::test
