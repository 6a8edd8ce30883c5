// Where the ports of a model are, by an application file: each on one host, or it is said why not.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "rules/model/model.hpp"
#include "rules/model/rule_set.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::rules {

// How a model and its application use a source.
struct SourceUse {
  Location where;                         // first
  bool in_model = false;                  // not only in a connection that no rule selects
  std::vector<std::string> connected_to;  // ports, in byte order, as those below
  std::vector<std::string> read_at;       // by a condition, and not connected there
};
using SourceUses = std::map<std::string, SourceUse>;
[[nodiscard]] SourceUses uses_of_sources(const RuleSet& rules);

class HostPlaces {
 public:
  // Reports what is on no host, or on several. `application` may be another one than the model's;
  // `path` is its file.
  HostPlaces(const RuleSet& rules, const SourceUses& uses, const Application& application,
             const std::string& path, Diagnostics& diagnostics);

  // Empty where that is not known. Of a source that is on several hosts: all, in byte order.
  [[nodiscard]] const std::vector<std::string>& of_source(const std::string& source) const;
  [[nodiscard]] std::string_view of_port(const std::string& port) const;
  // Whether samples of the source reach the port over the network, as far as is known.
  [[nodiscard]] bool are_apart(const std::string& source, const std::string& port) const;

  struct Count {
    std::size_t ports = 0, sources = 0;
  };
  // By host. Of what is on several, none.
  [[nodiscard]] const std::map<std::string, Count>& counts() const { return counts_; }

 private:
  std::map<std::string, std::vector<std::string>> of_sources_;
  std::map<std::string, std::string> of_ports_;
  std::map<std::string, Count> counts_;
};

}  // namespace arbiter::rules
