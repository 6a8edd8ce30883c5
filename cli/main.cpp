// arbiter: the tool on the command line.
#include <csignal>
#include <exception>
#include <iostream>

#include <CLI/CLI.hpp>

#include "cli/verbs.hpp"
#include "rules/load.hpp"

namespace {

constexpr int kFailed = 1;
constexpr int kWrongUse = 2;

int run(int argc, char** argv) {
  CLI::App app("Port arbitration for robot components: at most one connection of a port wins.",
               "arbiter");
  app.set_version_flag("--version", "arbiter " ARBITER_VERSION);
  app.require_subcommand(1);
  int exit_code = 0;
  arbiter::cli::add_check(app, exit_code);
  arbiter::cli::add_diff(app, exit_code);
  arbiter::cli::add_rules(app, exit_code);
  arbiter::cli::add_graph(app, exit_code);
  arbiter::cli::add_compile(app, exit_code);
  arbiter::cli::add_simulate(app, exit_code);
  arbiter::cli::add_play(app, exit_code);
  arbiter::cli::add_echo(app, exit_code);
  arbiter::cli::add_pub(app, exit_code);
  arbiter::cli::add_status(app, exit_code);
  arbiter::cli::add_why(app, exit_code);
  arbiter::cli::add_deactivate(app, exit_code);
  arbiter::cli::add_reload(app, exit_code);
  arbiter::cli::add_switch(app, exit_code);
  arbiter::cli::add_rollback(app, exit_code);
  arbiter::cli::add_history(app, exit_code);
  arbiter::cli::add_stop(app, exit_code);
  try {
    app.parse(argc, argv);  // runs the verb
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kWrongUse;  // --help and --version come this way as well
  } catch (const arbiter::rules::FileError& error) {
    std::cerr << "arbiter: " << error.what() << '\n';
    return kWrongUse;
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);  // a reader that has gone is told as any other failure to write
  std::ios::sync_with_stdio(false);
  int exit_code = kFailed;
  try {
    exit_code = run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "arbiter: " << error.what() << '\n';
  }
  if (!std::cout.flush()) {
    std::cerr << "arbiter: cannot write to standard output\n";
    return exit_code == 0 ? kFailed : exit_code;
  }
  return exit_code;
}
