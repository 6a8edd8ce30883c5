// A reader that has gone, as in `arbiter simulate … | head`.
//
// SIGPIPE is ignored while a verb runs: a bell whose receiver has died must end nobody. So the
// write fails instead, and the program then ends as any other in a pipe does, without a word.
#pragma once

namespace arbiter::cli {

// Whether nobody reads standard output any more: the other end of its pipe is closed. Costs a
// system call.
[[nodiscard]] bool has_reader_gone();

// By SIGPIPE, which a shell says nothing about.
[[noreturn]] void end_by_broken_pipe();

}  // namespace arbiter::cli
