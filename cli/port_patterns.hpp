// Patterns of ports on the command line: `--port '/Base/*'`.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "wire/status.hpp"

namespace arbiter::cli {

// Warns on standard error of patterns that match nothing: each may be meant for what is yet to
// come, or be misspelt.
class PatternCheck {
 public:
  // `option`: "--port". The status is that of now, and must live as long as this.
  PatternCheck(std::string option, const wire::Status& status)
      : option_(std::move(option)), status_(status) {}

  // Of those of input ports, or of those among them that are arbitrated.
  void inputs(const std::vector<std::string>& patterns) const;
  void arbitrated_inputs(const std::vector<std::string>& patterns) const;
  void outputs(const std::vector<std::string>& patterns) const;

 private:
  const std::string option_;
  const wire::Status& status_;
};

// Ports that a pattern may match, and those at the other end, which it does not mean.
struct PatternNames {
  std::vector<std::string_view> names, others;
  std::string what;        // "input port that is open"
  std::string other_what;  // "output port: name an input port that it is connected to"
};

// Says so on standard error where the pattern matches none of the names.
void warn_without_match(const std::string& option, const std::string& pattern,
                        const PatternNames& known);

}  // namespace arbiter::cli
