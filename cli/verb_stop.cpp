// arbiter stop: ends the daemon, and returns when it is gone.
#include <iostream>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "cli/live.hpp"
#include "cli/verbs.hpp"

namespace arbiter::cli {
namespace {

int stop(const std::string& instance) {
  wire::Call daemon(caller("stop", instance));
  const shm::FileDescriptor process = daemon.process();
  wire::Message question;
  question.kind = wire::MessageKind::kStop;
  daemon.ask(question);
  daemon.wait_until_gone(process);
  std::cout << "the daemon has stopped; connected ports keep working\n";
  return 0;
}

}  // namespace

void add_stop(CLI::App& app, int& exit_code) {
  const auto instance = std::make_shared<std::string>();
  CLI::App* verb = app.add_subcommand("stop", "Stop the daemon; returns when it has gone");
  add_instance_option(*verb, *instance);
  verb->footer("Example:\n  arbiter stop");
  verb->callback([instance, &exit_code] { exit_code = stop(*instance); });
}

}  // namespace arbiter::cli
