// What statements may speak of: the ports, connections and sources that a model has.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "rules/model/model.hpp"
#include "rules/model/statement.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::rules {

class StatementNames {
 public:
  struct Port {
    bool is_arbitrated = false;
    std::vector<std::string> sources;  // of its connections
  };
  using Ports = std::map<std::string, Port, std::less<>>;

  StatementNames(const std::vector<std::string>& sources, Ports ports);

  // Whether the statement has a meaning in the model. Ports and sources that the model does not
  // know, ports that are not arbitrated, and winners that are not connected are reported as errors;
  // patterns that nothing matches as warnings.
  bool admit(const Statement& statement, Diagnostics& diagnostics);

 private:
  bool check_term(const WinnerTerm& term);
  const Port* find_port(const Mention& mention);
  // What to write in place of a name that no input port has.
  std::string advice_on_port(const std::string& name);
  [[nodiscard]] bool is_source(const std::string& name) const;
  bool check_winner(const std::string& port_name, const Port& port, const Mention& source);
  void warn_if_none_wins(const std::string& port_name, const Port& port, const Mention& pattern);
  bool check_source(const Mention& source);
  void warn_if_unmatched(const Mention& glob);
  std::string correction_of(const std::string& pattern, const std::vector<std::string_view>& names);
  void report(std::string code, const Mention& mention, std::string message, Subject about);
  bool may_suggest();

  const std::vector<std::string> sources_;  // in byte order
  const Ports ports_;
  std::unordered_map<std::string, bool> matched_;  // by pattern: whether any source does
  std::size_t unknown_ = 0;
  const Statement* statement_ = nullptr;  // the one that is admitted
  Diagnostics* diagnostics_ = nullptr;
};

}  // namespace arbiter::rules
