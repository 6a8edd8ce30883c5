// arbiter recording sample: what was in one recorded sample.
#pragma once

namespace CLI {
class App;
}

namespace arbiter::cli {

void add_recorded_sample(CLI::App& parent, int& exit_code);

}  // namespace arbiter::cli
