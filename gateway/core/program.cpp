#include "gateway/core/program.hpp"

#include <sys/prctl.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <algorithm>
#include <exception>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <utility>

#include <CLI/CLI.hpp>

#include "command_line/standard_streams.hpp"
#include "command_line/values.hpp"
#include "command_line/wrong_use.hpp"
#include "gateway/core/kept_files.hpp"
#include "gateway/core/reload.hpp"
#include "gateway/core/say.hpp"
#include "gateway/core/send_idle.hpp"
#include "gateway/core/stop_signals.hpp"
#include "gateway/core/supervisor.hpp"
#include "gateway/mapping/check_mapping.hpp"
#include "gateway/mapping/read_mapping.hpp"
#include "rules/ask/report.hpp"
#include "rules/text/text_file.hpp"
#include "shm/clock.hpp"
#include "shm/descriptor_limit.hpp"
#include "shm/file_descriptor.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::gateway {
namespace {

constexpr const char* kExitCodes =
    "\nSIGUSR1 makes it read its mapping again; a bad one changes nothing, and the log says why.\n"
    "Exit codes: 0 ended by SIGINT, SIGTERM or SIGHUP, or the mapping is fine (--check);\n"
    "1 an error, or an idle sample that could not be sent (--send-idle);\n"
    "2 wrong use, or a mapping that cannot be read or has errors";

constexpr shm::Nanoseconds kSendIdle = 1'000'000'000;

// More than a file of the most entries, all with two ports, needs. The kernel keeps a table of
// them.
constexpr rlim_t kMostDescriptors = 32768;

struct Arguments {
  std::vector<std::string> mappings;
  std::string instance;
  std::string copy;  // file, empty: none is kept
  bool check = false;
  bool send_idle = false;
  bool is_worker = false;  // of a supervised program
  int files = -1;          // which the supervisor has read for it
};

constexpr unsigned kEndsWithin = 2;  // s
// A supervisor looks once a second, and gives its worker five (Patience::silence).
constexpr shm::Nanoseconds kBeatPeriod = 400'000'000;

// Whoever only checks wants all of it, however long that takes. A gateway goes on.
void tell(const rules::Diagnostics& diagnostics, bool only_checks) {
  if (only_checks) {
    rules::write_text(std::cerr, diagnostics);
    return;
  }
  std::ostringstream text;
  rules::write_text(text, diagnostics);
  say_lines(text.str());
}

// Nothing: there are errors, which have been said.
std::optional<std::vector<Mapping>> read(const Arguments& arguments, const ProgramKind& kind,
                                         const ReadFile& read_file) {
  rules::Diagnostics diagnostics;
  std::vector<Mapping> mappings;
  std::size_t entries = 0;
  for (const std::string& path : arguments.mappings) {
    mappings.push_back(read_mapping_file(path, diagnostics, read_file));
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
  tell(diagnostics, arguments.check);
  if (diagnostics.has_errors()) return {};
  if (arguments.check) std::cout << "ok: " << entries << (entries == 1 ? " entry\n" : " entries\n");
  return mappings;
}

// What the gateway that has died went by, if it has left that.
std::optional<std::vector<Mapping>> read_for_idle(const Arguments& arguments,
                                                  const ProgramKind& kind) {
  if (!arguments.copy.empty()) {
    try {
      const KeptFiles copy = KeptFiles::saved(arguments.copy);
      if (auto mappings = read(arguments, kind, copy.kept())) return mappings;
    } catch (const rules::FileError& error) {
      say(Level::kWarning, error.what());
    }
    say(Level::kWarning, "no copy of the mapping is good: the mapping itself is read");
  }
  KeptFiles files;
  return read(arguments, kind, files.from_disk(false));
}

// For --send-idle. A gateway that cannot leave it is one all the same; but then one of another
// mapping must not be found, by which nobody would tell the robot to stop that this one drives.
void leave_copy(const Arguments& arguments, const KeptFiles& files) {
  if (arguments.copy.empty()) return;
  try {
    files.save(arguments.copy);
  } catch (const std::exception& error) {
    ::unlink(arguments.copy.c_str());
    say(Level::kWarning, std::string("no copy of the mapping is kept: ") + error.what());
  }
}

std::function<void()> sign_of_life() {
  if (auto beat = heartbeat()) return std::move(*beat);
  if (sd_watchdog_enabled(0, nullptr) <= 0) return {};
  return [] { sd_notify(0, "WATCHDOG=1"); };
}

std::unique_ptr<Setup> setup_of(const Arguments& arguments, const ProgramKind& kind,
                                std::vector<Mapping> mappings, const MakeMiddleware& make) {
  auto setup = std::make_unique<Setup>();
  setup->settings = {std::move(mappings), {kind.name, arguments.instance, {}}};
  setup->middleware = make(setup->settings, setup->bell);
  return setup;
}

// Null: something is wrong, which has been said. Reads regular files alone, because the gateway
// serves on the same thread.
std::unique_ptr<Setup> read_again(const Arguments& arguments, const ProgramKind& kind,
                                  const MakeMiddleware& make) {
  try {
    KeptFiles files;
    auto mappings = read(arguments, kind, files.from_disk(true));
    if (mappings) {
      auto setup = setup_of(arguments, kind, std::move(*mappings), make);
      leave_copy(arguments, files);
      return setup;
    }
  } catch (const std::exception& error) {
    say(Level::kError, error.what());
  }
  return nullptr;
}

int send_idle_of(const Setup& setup, const ProgramKind& kind) {
  // What needs a supervisor may also hang, and here nobody looks after it.
  if (kind.is_supervised) ::alarm(kSendIdle / 1'000'000'000 + kEndsWithin);
  return send_idle(setup.settings.mappings, kind.kind, *setup.middleware, kSendIdle) ? 0
                                                                                     : kHasFailed;
}

// Gives a sign of life with each call, but not more often than kBeatPeriod: each wakes a process.
class Beat {
 public:
  void operator()() {
    const shm::Nanoseconds now = shm::monotonic_now();
    if (!beat_ || now < again_) return;
    again_ = now + kBeatPeriod;
    beat_();
  }

 private:
  const std::function<void()> beat_ = sign_of_life();
  shm::Nanoseconds again_ = 0;
};

// What the middleware would do at the end may never return, or end the process in another way. So
// nothing is destroyed: ports are closed as those of a program that dies are, by the daemon, at
// once.
[[noreturn]] void begin_anew(const NeedsNewProcess& why) {
  say(Level::kWarning, std::string(why.what()) + "; the gateway begins anew");
  finish_saying();
  std::_Exit(kBeginsAnew);
}

// The daemon does not know what this gateway has open: it begins anew, by the mapping that it has.
// Where it cannot, this is called again, each second: `told` is the reason that was said last.
void leave_lost_ports(const Setup& setup, const Arguments& arguments, const ProgramKind& kind,
                      const MakeMiddleware& make, Reload& reload, std::string& told) {
  const std::string why =
      "the daemon does not know what this gateway has open, because the state of the last daemon "
      "is lost";
  if (arguments.is_worker) throw LostPorts(why);
  if (reload.has_next()) return;
  try {
    reload.begin_anew(setup_of(arguments, kind, setup.settings.mappings, make));
    say(Level::kWarning, why + "; the gateway begins anew");
  } catch (const std::exception& error) {  // as of a middleware that has no descriptor left
    if (std::exchange(told, error.what()) == error.what()) return;
    say(Level::kError, why + "; the gateway cannot begin anew: " + told);
  }
}

// Until it is to stop.
void serve(std::unique_ptr<Setup> setup, const Arguments& arguments, const ProgramKind& kind,
           const MakeMiddleware& make, Reload& reload) {
  Beat beat;
  std::string told;
  for (; setup != nullptr; setup = reload.take()) {
    BridgeOptions options = setup->settings.bridge;
    options.on_round = [&] {
      beat();
      reload.look();
    };
    options.on_turned_away = [&] { leave_lost_ports(*setup, arguments, kind, make, reload, told); };
    Bridge bridge(std::move(options), setup->settings.mappings, kind.kind, setup->bell,
                  *setup->middleware);
    try {
      bridge.run(reload.ends());
    } catch (const NeedsNewProcess& why) {  // while the bridge and its middleware still stand
      begin_anew(why);
    }
  }
}

// `files`: what the mappings were read from.
int serve(const Arguments& arguments, const ProgramKind& kind, std::vector<Mapping> mappings,
          const KeptFiles& files, const MakeMiddleware& make, int stop) {
  auto setup = setup_of(arguments, kind, std::move(mappings), make);
  if (arguments.send_idle) return send_idle_of(*setup, kind);
  shm::FileDescriptor asked;
  if (!arguments.is_worker) {
    asked = catch_reload_signal();
    leave_copy(arguments, files);
  }
  Reload reload(asked.get(), stop, [&] { return read_again(arguments, kind, make); });
  if (!arguments.is_worker) sd_notify(0, "READY=1");
  serve(std::move(setup), arguments, kind, make, reload);
  // What the middleware does when the process ends may wait for ever, for a daemon of its own that
  // has gone; and the supervisor, who would see to it, may be gone as well.
  if (arguments.is_worker) ::alarm(kEndsWithin);
  return 0;
}

// Each worker is given the mapping as it was when it was good last, under one number.
int supervise_workers(const Arguments& arguments, const ProgramKind& kind, const KeptFiles& files,
                      std::vector<std::string> worker, int stop) {
  const shm::FileDescriptor copy = files.in_memory();
  leave_copy(arguments, files);
  worker.insert(worker.begin() + 1,  // behind a "--" they would be mappings
                {"--worker", "--files=" + std::to_string(copy.get())});
  const shm::FileDescriptor asked = catch_reload_signal();
  const auto renew = [&] {
    if (!take_signal(asked.get())) return false;
    KeptFiles again;
    try {
      if (read(arguments, kind, again.from_disk(true))) {
        const shm::FileDescriptor another = again.in_memory();
        if (::dup2(another.get(), copy.get()) >= 0) {
          leave_copy(arguments, again);
          say(Level::kInfo, "the mapping was read again: the gateway begins anew with it");
          return true;
        }
      }
    } catch (const std::exception& error) {
      say(Level::kError, error.what());
    }
    say(Level::kError, "the mapping was not read again: the one before stays");
    return false;
  };
  sd_notify(0, "READY=1");
  return supervise(worker, stop, kind.clean_up, {}, {asked.get(), renew});
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
  app.add_option("--copy", arguments.copy,
                 "File for a copy of the mapping that it has taken up, which --send-idle then goes "
                 "by: MAPPING may have become bad")
      ->type_name("FILE");
  app.add_flag("--worker", arguments.is_worker)->group("");
  app.add_option("--files", arguments.files)->group("");
  command_line::refuse_empty(app);
  app.footer(kind.more + kExitCodes);
  app.failure_message(command_line::wrong_use_text);
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
  KeptFiles files;
  if (arguments.files >= 0) files = KeptFiles(arguments.files);
  auto mappings =
      arguments.send_idle
          ? read_for_idle(arguments, kind)
          : read(arguments, kind, arguments.files >= 0 ? files.kept() : files.from_disk(false));
  if (!mappings) return 2;
  if (arguments.check) return 0;
  const shm::FileDescriptor stop = catch_stop_signals();
  if (arguments.is_worker) end_with_supervisor(kind.clean_up);
  if (!kind.is_supervised || arguments.is_worker || arguments.send_idle) {
    return serve(arguments, kind, std::move(*mappings), files, make, stop.get());
  }
  return supervise_workers(arguments, kind, files, {argv, argv + argc}, stop.get());
}

}  // namespace

int run_program(int argc, char** argv, const ProgramKind& kind, const MakeMiddleware& make) {
  if (!command_line::open_standard_streams()) return 1;
  set_program_name(kind.name);
  shm::raise_descriptor_limit(kMostDescriptors);
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
