// Who can take what arbiter pub sends, as the daemon sees it once the port is open.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <arbiter/type.hpp>

#include "cli/other_hosts.hpp"
#include "wire/status.hpp"

namespace arbiter::cli {

// The command line as it was given: an option and its value, or a positional argument and no
// option. The same with another type can be made of it.
struct PubCommand {
  using Argument = std::pair<std::string, std::string>;  // {"--count", "1"}, {"", "/Face/pos:o"}
  std::vector<Argument> arguments;
  std::size_t payload_size = 0;
  bool has_type = false;

  // "arbiter pub /Face/pos:o --like /Gaze/pos:i --count 1", to be pasted into a shell. A payload of
  // another size is left out.
  [[nodiscard]] std::string like(const std::string& port, std::size_t size) const;
};

struct Takers {
  bool is_any = false;                // somebody can; or nobody should, for the source is only read
  std::vector<std::string> messages;  // what else a user should know, a sentence each
};

// What other hosts do with the source: samples cross to them by the links.
struct TakersElsewhere {
  std::vector<std::string> takers;   // "/Motor/speed:i of host base"
  std::vector<std::string> readers;  // hosts whose rules read it, and which take no samples
  std::vector<std::string> own;      // as takers, but they obey their host's own source of the name
  bool is_imported = true;           // by all of them

  [[nodiscard]] bool is_any() const { return !takers.empty() || !readers.empty(); }
  // Sentences; empty: there are none.
  [[nodiscard]] std::string text(const std::string& port) const;
};
// A host that has the source from somewhere else, or has it open itself, takes nothing from here.
[[nodiscard]] TakersElsewhere find_elsewhere(const OtherHosts& others, const std::string& port,
                                             const Type& type);
// Whether the link of this host sends the source to others.
[[nodiscard]] bool is_sent_to_others(const wire::Status& status, const std::string& port);

// Refused connections and ports that the model does not mention come as notices, and are not said
// again: for the former there is advice.
[[nodiscard]] Takers find_takers(const wire::Status& status, const std::string& port,
                                 const Type& type, const PubCommand& command,
                                 const TakersElsewhere& elsewhere = {});

}  // namespace arbiter::cli
