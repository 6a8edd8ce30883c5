#pragma once

#include <gtest/gtest.h>

#include "rules/prove/compile.hpp"

namespace arbiter::test {

// A rule set in which there is no error.
inline rules::CompiledModel compiled(const rules::RuleSet& set) {
  rules::Diagnostics diagnostics;
  auto model = compile(set, diagnostics);
  EXPECT_FALSE(diagnostics.has_errors());
  return model;
}

}  // namespace arbiter::test
