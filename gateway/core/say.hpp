// Lines on standard error, for people or for the journal.
#pragma once

#include <string>
#include <string_view>

namespace arbiter::gateway {

enum class Level { kError, kWarning, kInfo };

// What lines begin with on a terminal: the program's name. Before threads start.
void set_program_name(std::string_view name);

// One line; the journal is told its level. Control characters are escaped. Any thread, but not in a
// child between fork() and exec().
//
// Whether or not somebody reads it: a line waits 10 ms for the reader; once one has waited in vain,
// no other does, until the reader has caught up (logging/log_writer.hpp). When the process exits,
// what waits then has another second; who ends it in another way calls finish_saying().
void say(Level level, std::string_view text);
// Whole lines, as they are: findings with what they are about.
void say_lines(std::string lines);
// Before _Exit(), or a signal that ends the process: waits a second at most for what was said.
void finish_saying();

}  // namespace arbiter::gateway
