#include "gateway/core/program.hpp"

#include <sys/prctl.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <algorithm>
#include <exception>
#include <iostream>
#include <stdexcept>
#include <utility>

#include <CLI/CLI.hpp>

#include "gateway/core/say.hpp"
#include "gateway/core/send_idle.hpp"
#include "gateway/core/stop_signals.hpp"
#include "gateway/core/supervisor.hpp"
#include "gateway/mapping/check_mapping.hpp"
#include "gateway/mapping/read_mapping.hpp"
#include "rules/ask/report.hpp"
#include "rules/text/text_file.hpp"
#include "shm/file_descriptor.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::gateway {
namespace {

constexpr const char* kExitCodes =
    "\nExit codes: 0 ended by SIGINT, SIGTERM or SIGHUP, or the mapping is fine (--check);\n"
    "1 an error; 2 wrong use, or a mapping that cannot be read or has errors";

constexpr shm::Nanoseconds kSendIdle = 1'000'000'000;

struct Arguments {
  std::vector<std::string> mappings;
  std::string instance;
  bool check = false;
  bool send_idle = false;
  bool is_worker = false;  // of a supervised program
};

constexpr unsigned kEndsWithin = 2;  // s

// Nothing: there are errors, which have been said.
std::optional<std::vector<Mapping>> read(const Arguments& arguments, const ProgramKind& kind) {
  rules::Diagnostics diagnostics;
  std::vector<Mapping> mappings;
  std::size_t entries = 0;
  for (const std::string& path : arguments.mappings) {
    mappings.push_back(read_mapping_file(path, diagnostics));
    for (const Gateway& gateway : mappings.back().gateways) {
      if (gateway.kind == kind.kind) entries += gateway.entries.size();
    }
  }
  check_mappings(mappings, nullptr, diagnostics);
  if (entries == 0 && !diagnostics.has_errors()) {
    diagnostics.error("no-entries", {arguments.mappings.front(), 1, 1},
                      std::string("there is no <in> and no <out> of a <gateway kind=\"") +
                          name_of(kind.kind) + "\">; write some, or start another gateway");
  }
  if (!arguments.check) diagnostics.drop_notes();
  rules::write_text(std::cerr, diagnostics);
  if (diagnostics.has_errors()) return {};
  if (arguments.check) std::cout << "ok: " << entries << (entries == 1 ? " entry\n" : " entries\n");
  return mappings;
}

int serve(const Arguments& arguments, const ProgramKind& kind, std::vector<Mapping> mappings,
          const MakeMiddleware& make, int stop) {
  Settings settings{std::move(mappings), {kind.name, arguments.instance, {}}};
  if (auto beat = heartbeat()) settings.bridge.on_round = std::move(*beat);
  const Bell bell;
  const auto middleware = make(settings, bell);
  if (arguments.send_idle) {
    // What needs a supervisor may also hang, and here nobody looks after it.
    if (kind.is_supervised) ::alarm(kSendIdle / 1'000'000'000 + kEndsWithin);
    send_idle(settings.mappings, kind.kind, *middleware, kSendIdle);
    return 0;
  }
  Bridge bridge(settings.bridge, settings.mappings, kind.kind, bell, *middleware);
  try {
    bridge.run(stop);
  } catch (const NeedsNewProcess& why) {
    // What the middleware would do at the end may never return, or end the process in another way.
    // Its ports are closed as those of a program that dies are: by the daemon, at once.
    say(Level::kWarning, std::string(why.what()) + "; the gateway begins anew");
    std::_Exit(kBeginsAnew);
  }
  // What the middleware does when the process ends may wait for ever, for a daemon of its own that
  // has gone; and the supervisor, who would see to it, may be gone as well.
  if (arguments.is_worker) ::alarm(kEndsWithin);
  return 0;
}

int run(int argc, char** argv, const ProgramKind& kind, const MakeMiddleware& make) {
  Arguments arguments;
  CLI::App app(kind.about, kind.name);
  app.set_version_flag("--version", kind.name + " " + ARBITER_VERSION);
  app.add_option("MAPPING", arguments.mappings,
                 "Files that say which topics pass through which ports")
      ->required()
      ->type_name("");
  app.add_option(
         "--instance", arguments.instance,
         "Name of the daemon; by default $ARBITER_INSTANCE, or \"default\" if that is not set")
      ->type_name("NAME");
  app.add_flag("--check", arguments.check,
               "Only say what is wrong with the mappings; `arbiter check MODEL --gateway MAPPING` "
               "also looks at the model");
  app.add_flag("--send-idle", arguments.send_idle,
               "Only send, for a second, what is sent while nobody commands (idle=): for a gateway "
               "that has died. Needs no daemon");
  app.add_flag("--worker", arguments.is_worker)->group("");
  app.footer(kind.more + kExitCodes);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    arguments.instance = wire::instance_name(arguments.instance);
  } catch (const std::invalid_argument& error) {
    say(Level::kError, error.what());
    return 2;
  }
  auto mappings = read(arguments, kind);
  if (!mappings) return 2;
  if (arguments.check) return 0;
  const shm::FileDescriptor stop = catch_stop_signals();
  if (arguments.is_worker) end_with_supervisor(kind.clean_up);
  if (!kind.is_supervised || arguments.is_worker || arguments.send_idle) {
    if (!arguments.is_worker && !arguments.send_idle) sd_notify(0, "READY=1");
    return serve(arguments, kind, std::move(*mappings), make, stop.get());
  }
  std::vector<std::string> worker(argv, argv + argc);
  worker.insert(worker.begin() + 1, "--worker");  // behind a "--" it would be a mapping
  sd_notify(0, "READY=1");
  return supervise(worker, stop.get(), kind.clean_up);
}

}  // namespace

int run_program(int argc, char** argv, const ProgramKind& kind, const MakeMiddleware& make) {
  set_program_name(kind.name);
  try {
    return run(argc, argv, kind, make);
  } catch (const rules::FileError& error) {
    say(Level::kError, error.what());
    return 2;
  } catch (const std::exception& error) {
    say(Level::kError, error.what());
    return kHasFailed;
  }
}

}  // namespace arbiter::gateway
