// arbiter recording winners: who commanded when.
#pragma once

namespace CLI {
class App;
}

namespace arbiter::cli {

void add_recorded_winners(CLI::App& parent, int& exit_code);

}  // namespace arbiter::cli
