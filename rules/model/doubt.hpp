// What of a model can still be judged although something in it is wrong.
//
// A check goes on behind an error with what does not depend on it: two connections that can both
// win are told of beside a timeout that cannot be read. What does depend on it is left out, for
// whatever is said of it may only follow from the error. Where in doubt, it does.
#pragma once

#include <optional>
#include <set>
#include <string>

#include "rules/model/hierarchy.hpp"
#include "rules/model/model.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::rules {

struct Doubts {
  bool everything = false;      // of no port it is known what its rules are
  std::set<std::string> ports;  // of these it is not

  [[nodiscard]] bool about(const std::string& port) const {
    return everything || ports.count(port) != 0;
  }
};

// Of all that was found wrong with the model until now: by its reader and in its hierarchy, which
// both leave marks, and by checks that name the ports that they are about.
Doubts find_doubts(const Model& model, const Hierarchy& hierarchy, const Diagnostics& found);

// Whether something was refused that may have named sources or ports.
bool may_lack_names(const Model& model, const std::optional<Application>& application);

}  // namespace arbiter::rules
