// Lines on standard error, for people or for the journal.
#pragma once

#include <string_view>

namespace arbiter::gateway {

enum class Level { kError, kWarning, kInfo };

// What lines begin with on a terminal: the program's name. Before threads start.
void set_program_name(std::string_view name);

// One line; the journal is told its level. Control characters are escaped. Any thread.
void say(Level level, std::string_view text);

}  // namespace arbiter::gateway
