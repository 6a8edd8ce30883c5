// Of what the doctor has found, the codes.
#pragma once

#include <string>
#include <vector>

#include "watch/doctor.hpp"

namespace arbiter::test {

inline std::vector<std::string> codes_of(const watch::Findings& findings) {
  std::vector<std::string> codes;
  for (const auto& finding : findings) codes.push_back(finding.code);
  return codes;
}

}  // namespace arbiter::test
