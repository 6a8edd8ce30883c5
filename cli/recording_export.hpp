// arbiter recording export.
#pragma once

namespace CLI {
class App;
}

namespace arbiter::cli {

void add_export(CLI::App& parent, int& exit_code);

}  // namespace arbiter::cli
