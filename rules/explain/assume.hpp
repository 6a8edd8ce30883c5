// What is left of an expression once the activity of one source is known.
#pragma once

#include <string>

#include "rules/model/expression.hpp"

namespace arbiter::rules {

// The expression with the source taken as active: it does not read it any more, and has no constant
// inside of it, though it may be one. The same object where it does not read the source. Of an
// expression without quantifiers.
ExpressionPtr assume_active(const ExpressionPtr& expression, const std::string& source);

}  // namespace arbiter::rules
