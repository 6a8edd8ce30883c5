// Doctor: a daemon that has another model in force than the one that it was started with.
#include <string>

#include "rules/text/names.hpp"
#include "watch/doctor.hpp"

namespace arbiter::watch {

Findings examine_model(const wire::Status& status) {
  const auto& refused = status.model.refused;
  if (!refused) return {};
  return {{"model-refused",
           "the files of --model were refused (" + rules::comma_list(refused->files) +
               "), so the daemon keeps model " + std::to_string(status.model.generation) +
               " of the last one: " + refused->why,
           "until a reload succeeds no model can be switched to or rolled back to, and arbiter why "
           "does not know the behaviours",
           "mend the files (arbiter check shows all errors), then run arbiter reload"}};
}

}  // namespace arbiter::watch
