// arbiterd: the daemon of one instance, in the foreground.
#include <signal.h>
#include <sys/signalfd.h>
#include <sys/stat.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <optional>
#include <stop_token>
#include <utility>

#include <CLI/CLI.hpp>

#include "command_line/standard_streams.hpp"
#include "command_line/values.hpp"
#include "command_line/wrong_use.hpp"
#include "logging/journal.hpp"
#include "logging/log_writer.hpp"
#include "rules/text/names.hpp"
#include "service/daemon.hpp"
#include "service/log/event.hpp"
#include "service/log/log.hpp"
#include "service/log/log_sink.hpp"
#include "service/models/preparation.hpp"
#include "shm/descriptor_limit.hpp"
#include "wire/rendezvous.hpp"

namespace {

using arbiter::service::Daemon;
using arbiter::service::EventKind;
using arbiter::service::log_event;
namespace log = arbiter::service::log;

constexpr const char* kExample = R"(
Example:
  arbiterd --model search_and_track.xml
  arbiterd --model search=search.xml --model dance=dance.xml     # and then: arbiter switch dance

It runs in the foreground, needs no configuration and no privileges, and logs to standard error;
under systemd to the journal, where journalctl ARBITER_PORT=/Arm/pos:i shows what is about one port.
Files must be regular ones. Warnings about them are logged; with --strict they refuse the files.
With --check it says what it finds in the files and ends: before you start it, or reload.
SIGHUP and `arbiter reload` read all again; a bad one changes nothing.
SIGTERM, SIGINT and `arbiter stop` stop it. Without --policy every user may open ports and observe,
and only root and the daemon's own user may reload, switch and stop.
Components go on without it. The next daemon of the instance takes them over, and puts its own model
in force: if it has several, the one with the name that was in force. Without --model, or if the
models have errors, it keeps the model in force.
It listens in the first of these that it can use: $RUNTIME_DIRECTORY, $XDG_RUNTIME_DIR/arbiter,
/run/arbiter, arbiter-UID in the temporary directory.

Exit codes: 0 stopped by a signal or by `arbiter stop`, or --check finds no error; 1 the files have
errors, or it cannot serve; 2 wrong use)";

arbiter::shm::FileDescriptor catch_signals() {
  sigset_t caught;
  sigemptyset(&caught);
  for (const int number : {SIGHUP, SIGTERM, SIGINT}) sigaddset(&caught, number);
  sigprocmask(SIG_BLOCK, &caught, nullptr);
  // What they are about, the calls say that fail (SIGXFSZ: for a limit of files' sizes).
  for (const int number : {SIGPIPE, SIGXFSZ}) signal(number, SIG_IGN);
  return arbiter::shm::FileDescriptor(signalfd(-1, &caught, SFD_CLOEXEC | SFD_NONBLOCK));
}

// Whatever umask it was started with: what its successor will believe, no other user may write.
void keep_files_from_others() { umask(umask(0) | S_IWGRP | S_IWOTH); }

// None where standard error does not lead to it. Its socket lies elsewhere in tests, and in a
// container that has it from outside.
std::optional<arbiter::logging::JournalSocket> find_journal() {
  using namespace arbiter::logging;
  if (!is_journal(STDERR_FILENO, std::getenv("JOURNAL_STREAM"))) return {};
  const char* const path = std::getenv("ARBITER_JOURNAL_SOCKET");
  return JournalSocket(path != nullptr ? path : kJournalSocket);
}

// Says all that is left to be said, unless nobody reads it, and ends.
class Log {
 public:
  explicit Log(const std::string& level) {
    using namespace arbiter::service;
    auto sink = std::make_shared<LogSink>(
        std::make_shared<arbiter::logging::LogWriter>(STDERR_FILENO, find_journal()));
    log::set_default_logger(std::make_shared<log::logger>("arbiterd", std::move(sink)));
    log::set_level(log::level::from_str(level));
  }
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;
  ~Log() { log::shutdown(); }
};

// What a daemon with these options would say of its files.
int check(const arbiter::service::DaemonOptions& options) {
  using namespace arbiter::service;
  const Gate gate(options.policy);
  StatusLine progress(options.instance);
  const Reading reading =
      read_files(options.models, gate, {options.steps, progress.watch(), options.is_strict},
                 std::stop_token{});
  if (reading.findings.has_errors()) {
    log::error("{}", reading.findings.why_refused());
    return 1;
  }
  log::info("a daemon can start with these files: {}, {}",
            arbiter::rules::counted(reading.models.size(), "model"),
            options.policy ? "the policy " + *options.policy : "no policy");
  return 0;
}

int serve(const arbiter::service::DaemonOptions& options,
          const arbiter::shm::FileDescriptor& signals) {
  arbiter::shm::raise_descriptor_limit();  // components and sources take a few each
  Daemon daemon(options);
  log_event({EventKind::kReady}, log::level::info, "instance \"{}\" is ready at {}",
            options.instance, daemon.path());
  for (const std::string& other :
       arbiter::wire::other_daemons(options.instance, options.directory)) {
    log::warn(
        "another daemon of instance \"{}\" listens at {}: components that meet there share nothing "
        "with those that meet here; stop one of the two, or give it another --instance",
        options.instance, other);
  }
  sd_notifyf(0, "READY=1\nSTATUS=instance %s", options.instance.c_str());
  daemon.run(signals.get());
  sd_notify(0, "STOPPING=1");
  return 0;
}

struct CommandLine {
  arbiter::service::DaemonOptions options;
  std::vector<std::string> models;
  std::vector<std::string> applications;
  std::string policy;
  std::string instance;
  std::string level = "info";
  double effort = 1;
  bool only_checks = false;

  void describe(CLI::App& app);
  // What it says is in `options` then. Throws std::invalid_argument.
  void judge();
};

void CommandLine::describe(CLI::App& app) {
  app.footer(kExample);
  app.set_version_flag("--version", std::string("arbiterd ") + ARBITER_VERSION);
  app.add_option("--model", models,
                 "Model file; several files with the same NAME, or without one, form one model. "
                 "The first model comes into force; `arbiter switch` goes to the others")
      ->type_name("[NAME=]FILE");
  app.add_option(
         "--application", applications,
         "Application file, which says which connections exist; without NAME, for all models")
      ->type_name("[NAME=]FILE");
  app.add_option(
         "--policy", policy,
         "Policy file, which says who may open which ports, reload, switch, stop and observe")
      ->type_name("FILE");
  app.add_flag(
      "--strict", options.is_strict,
      "Treat warnings as errors: refuse files that have any, at the start and at a reload");
  app.add_flag("--check", only_checks,
               "Read and prove the files, say what is wrong with them, and end");
  app.add_option(
         "--instance", instance,
         "Name of this daemon; by default $ARBITER_INSTANCE, or \"default\" if that is not set")
      ->type_name("NAME");
  app.add_option("--user-share", options.user_share,
                 "The percentage of names, clients, descriptors and unread messages that one user "
                 "may have, of what the others have left (default " +
                     std::to_string(options.user_share) + ")")
      ->type_name("PERCENT")
      ->check(arbiter::command_line::whole_number_between(1, 99));
  app.add_flag("--descriptor-store", options.uses_descriptor_store,
               "Leave descriptors with the service manager for the next daemon");
  app.add_option("--effort", effort,
                 "Allow the proof of a model this many times the usual number of steps")
      ->type_name("FACTOR")
      ->check(arbiter::command_line::number_between(arbiter::rules::Budget::kLeastEffort,
                                                    arbiter::rules::Budget::kMostEffort));
  app.add_option("--log-level", level, "trace, debug, info (default), warn or error")
      ->type_name("LEVEL")
      ->check(arbiter::command_line::one_of({"trace", "debug", "info", "warn", "error"}));
  arbiter::command_line::refuse_empty(app);
  app.failure_message(arbiter::command_line::wrong_use_text);
}

void CommandLine::judge() {
  if (!policy.empty()) options.policy = policy;
  options.steps = arbiter::rules::Budget::steps_of(effort);
  options.models = arbiter::service::named_files(models, applications);
  options.instance = arbiter::wire::instance_name(instance);
}

int run(int argc, char** argv) {
  CLI::App app("arbiterd: decides at each input port whose data gets through", "arbiterd");
  CommandLine line;
  line.describe(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  keep_files_from_others();
  // Before there are threads: they inherit what is blocked.
  const auto signals = line.only_checks ? arbiter::shm::FileDescriptor() : catch_signals();
  const Log logging(line.level);
  try {
    line.judge();
    if (line.only_checks) return check(line.options);
    line.options.directory = arbiter::wire::daemon_directory();
    line.options.stop_descriptor = signals.get();
    return serve(line.options, signals);
  } catch (const arbiter::rules::Stopped&) {  // by a signal, before it was ready
    return 0;
  } catch (const std::invalid_argument& error) {
    log::error("{}", error.what());
    return 2;
  } catch (const std::exception& error) {
    log::error("{}", error.what());
    return 1;
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (!arbiter::command_line::open_standard_streams()) return 1;
  try {
    const int exit_code = run(argc, argv);
    if (arbiter::service::Compiler::has_left_a_thread()) std::_Exit(exit_code);
    return exit_code;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "arbiterd: %s\n", error.what());
    return 1;
  }
}
