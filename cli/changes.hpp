// Changes of the model that verbs ask for: to one daemon, once, and for as long as it takes.
#pragma once

#include <string>

#include "wire/change_report.hpp"
#include "wire/messages.hpp"

namespace arbiter::cli {

// The daemon's report on the change, which may be a refusal. Writes the report to standard output
// (`json`, with the open ports that the model does not mention), or what was found in files, and
// why the change is refused, to standard error. Throws wire::CallError where there is no daemon, or
// it does not allow it.
wire::ChangeReport ask_for_change(const std::string& verb, const std::string& instance,
                                  wire::Message question, bool json);

// Asks for it, and says, unless `json`: "model 5 is in force", what that changes, and which open
// ports it does not mention. Gives the verb's exit code. Throws as ask_for_change().
int change_model(const std::string& verb, const std::string& instance,
                 const wire::Message& question, bool json);

// Asks for a dry run, of a reload or a rollback, and says, unless `json`, what it would change. The
// rest is as in change_model().
int preview_change(const std::string& verb, const std::string& instance,
                   const wire::Message& question, bool json);

}  // namespace arbiter::cli
