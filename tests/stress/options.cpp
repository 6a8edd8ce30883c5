#include "tests/stress/options.hpp"

#include <cstdlib>
#include <random>

#include <CLI/CLI.hpp>

namespace arbiter::stress {

Options parse(int argc, char** argv) {
  Options options;
  options.seed = std::random_device()() & 0x7fffffff;
  bool no_swaps = false;
  CLI::App app(
      "Publishers, receivers, relays and a daemon in tiny queues, and what they did, checked");
  app.add_option("--seed", options.seed, "Makes the decisions of all generators");
  app.add_option("--seconds", options.seconds, "Goes on for so long");
  app.add_option("--operations", options.operations,
                 "Goes on for so many arrivals and takes instead");
  app.add_option("--publishers", options.publishers, "1 to 8; else each round another number")
      ->check(CLI::Range(1, 8));
  app.add_option("--receivers", options.receivers, "1 to 8; else each round another number")
      ->check(CLI::Range(1, 8));
  app.add_option("--kills", options.kills, "SIGKILL so many components, at random");
  app.add_option("--stops", options.stops, "SIGSTOP so many, one after the other");
  app.add_option("--stop-seconds", options.stop_seconds, "Each stop lasts at least so long");
  app.add_option("--daemon-kills", options.daemon_kills,
                 "SIGKILL the daemon so often, and start another");
  app.add_flag("--without-daemon", options.keep_daemon_dead,
               "SIGKILL the daemon in each round, and start no other");
  app.add_flag("--no-swaps", no_swaps, "Leave the model as it is");
  app.add_flag("--threads", options.threads, "Threads instead of processes");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    std::exit(app.exit(error) == 0 ? 0 : 2);
  }
  options.swaps = !no_swaps;
  return options;
}

}  // namespace arbiter::stress
