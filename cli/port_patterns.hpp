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
  void warn(const std::string& pattern, const std::vector<std::string_view>& names,
            const std::vector<std::string_view>& others, const std::string& what,
            const std::string& other_what) const;

  const std::string option_;
  const wire::Status& status_;
};

// What a pattern that matches none of the names was probably meant to be: "/Base/*" for "/Bse/*".
// Empty: nothing like it is there.
[[nodiscard]] std::string similar_pattern(const std::string& pattern,
                                          const std::vector<std::string_view>& names);

}  // namespace arbiter::cli
