// The one answer to whoever names a source where an input port is asked for.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rules/ask/host_places.hpp"

namespace arbiter::rules {

struct AskedForPort {
  const std::string& name;  // no input port has it
  std::string none;         // "the model has no input port /Fcae/pos:o"
  // What to write in place of it, with a port that this source leads to: "--port /Gaze/pos:i".
  std::function<std::string(const std::string& port, const std::string& source)> instead;
};

// Where the name is that of a source, or nearest to one: what is wrong and what to do. Empty: it
// has nothing to do with any.
std::optional<std::string> about_source_as_port(const AskedForPort& asked,
                                                std::vector<std::string_view> ports,
                                                const SourceUses& sources);

// The same of a model; of any other name, the nearest port or that `arbiter rules` shows them.
std::string about_no_port(const AskedForPort& asked, const RuleSet& rules);

}  // namespace arbiter::rules
