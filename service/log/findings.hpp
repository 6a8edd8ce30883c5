// What readers find in files, for the log and for whoever asked to have them read.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "rules/text/diagnostic.hpp"

namespace arbiter::service {

inline constexpr const char* kOfPolicy = "the policy";

// Of several files that are read together: a policy and models.
class Findings {
 public:
  explicit Findings(bool takes_warnings_for_errors = false)
      : takes_warnings_for_errors_(takes_warnings_for_errors) {}

  // Logs them too. `of` is what was read, as in a sentence: kOfPolicy, "the model work". What was
  // found of it before stays.
  void add(std::string of, rules::Diagnostics diagnostics);
  // It could not be read at all; the sentence says why.
  void add_failure(std::string why);

  [[nodiscard]] bool has_errors() const;
  // "the files have errors, listed above", and that it is for warnings alone, where it is.
  [[nodiscard]] std::string why_refused() const;
  // "the model has errors: file:line:column: message", of the first error, and how many more there
  // are.
  [[nodiscard]] std::string first_error() const;
  // All of it, as `arbiter check` shows it.
  [[nodiscard]] std::string text() const;
  // [{"of", "findings": […]}], each list as `arbiter check --json` writes it.
  [[nodiscard]] nlohmann::json json() const;

 private:
  struct Part {
    std::string of;
    rules::Diagnostics diagnostics;
  };
  bool takes_warnings_for_errors_;
  bool had_errors_ = false;  // before warnings became errors
  std::vector<std::string> failures_;
  std::vector<Part> parts_;
};

}  // namespace arbiter::service
