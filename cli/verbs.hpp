// The verbs of the command line. Each adds itself to the program, and sets the exit code when it is
// the one that runs: 0 fine, 1 an error in what it looked at. Wrong use, and files that cannot be
// opened, are exceptions that main() turns into 2.
#pragma once

namespace CLI {
class App;
}

namespace arbiter::cli {

void add_check(CLI::App& app, int& exit_code);
void add_diff(CLI::App& app, int& exit_code);
void add_rules(CLI::App& app, int& exit_code);
void add_compile(CLI::App& app, int& exit_code);
void add_graph(CLI::App& app, int& exit_code);
void add_import(CLI::App& app, int& exit_code);
void add_simulate(CLI::App& app, int& exit_code);
void add_play(CLI::App& app, int& exit_code);
void add_echo(CLI::App& app, int& exit_code);
void add_pub(CLI::App& app, int& exit_code);
void add_record(CLI::App& app, int& exit_code);
void add_replay(CLI::App& app, int& exit_code);
void add_recording(CLI::App& app, int& exit_code);
void add_hosts(CLI::App& app, int& exit_code);
void add_status(CLI::App& app, int& exit_code);
void add_deactivate(CLI::App& app, int& exit_code);
void add_reload(CLI::App& app, int& exit_code);
void add_switch(CLI::App& app, int& exit_code);
void add_rollback(CLI::App& app, int& exit_code);
void add_history(CLI::App& app, int& exit_code);
void add_stop(CLI::App& app, int& exit_code);
void add_top(CLI::App& app, int& exit_code);
void add_why(CLI::App& app, int& exit_code);
void add_wait(CLI::App& app, int& exit_code);
void add_winners(CLI::App& app, int& exit_code);
void add_metrics(CLI::App& app, int& exit_code);
void add_doctor(CLI::App& app, int& exit_code);

}  // namespace arbiter::cli
