#include "watch/doctor.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "watch/abandoned_sockets.hpp"
#include "watch/process.hpp"
#include "wire/document.hpp"
#include "wire/meeting.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::watch {
namespace {

constexpr std::uint64_t kMebibyte = 1u << 20;
// What lock_memory takes for a few ports, with room to spare.
constexpr std::uint64_t kLockedMemory = 64 * kMebibyte;
constexpr std::uint64_t kDescriptors = 1024;
constexpr std::uint64_t kDaemonDescriptors = 4096;
constexpr std::uint64_t kMemory = 256 * kMebibyte;

// Those that the vDSO reads without a system call.
constexpr std::array<std::string_view, 4> kFastClocks{"tsc", "kvm-clock", "arch_sys_counter",
                                                      "hyperv_clocksource_tsc_page"};

std::string in_kibibytes(std::uint64_t bytes) { return std::to_string(bytes / 1024) + " KiB"; }

void examine_limits(const Machine& machine, Findings& found) {
  const auto memory = machine.limit("self", "Max locked memory");
  if (memory && *memory < kLockedMemory && !machine.has_capability("self", Capability::kIpcLock)) {
    found.push_back({"locked-memory",
                     "programs that are started from here may lock " + in_kibibytes(*memory) +
                         " of memory (RLIMIT_MEMLOCK)",
                     "a component with lock_memory, or one that calls mlockall(), does not start "
                     "or cannot lock "
                     "what is added later; without locked memory a page fault can hold up its loop",
                     "in the component's unit: LimitMEMLOCK=infinity; for logins, in "
                     "/etc/security/limits.d/robot.conf: @robot - memlock unlimited"});
  }
  const auto priority = machine.limit("self", "Max realtime priority");
  if (priority && *priority == 0 && !machine.has_capability("self", Capability::kSysNice)) {
    found.push_back({"realtime-priority",
                     "programs that are started from here may not use SCHED_FIFO (RLIMIT_RTPRIO is "
                     "0)",
                     "a control loop of ordinary priority waits for whatever else runs on its "
                     "processor",
                     "in the component's unit: LimitRTPRIO=80; for logins, in "
                     "/etc/security/limits.d/robot.conf: @robot - rtprio 80"});
  }
  const auto files = machine.limit("self", "Max open files");
  if (files && *files < kDescriptors) {
    found.push_back({"descriptors",
                     "programs that are started from here may have " + std::to_string(*files) +
                         " descriptors (RLIMIT_NOFILE)",
                     "a component needs a few for each port and each port connected to it, and "
                     "cannot be connected without them",
                     "ulimit -n " + std::to_string(kDescriptors) +
                         ", or in the component's unit: LimitNOFILE=65536"});
  }
}

void examine_clock(const Machine& machine, Findings& found) {
  const std::string folder = "/sys/devices/system/clocksource/clocksource0/";
  const auto clock = machine.read(folder + "current_clocksource");
  if (!clock) return;
  for (const auto& fast : kFastClocks) {
    if (*clock == fast) return;
  }
  const std::string others =
      " " + machine.read(folder + "available_clocksource").value_or("") + " ";
  const bool has_tsc = others.find(" tsc ") != std::string::npos;
  found.push_back(
      {"clock-source", "the kernel's clock is " + *clock,
       "to read it takes a system call of a microsecond or more, and each publish() and take() "
       "reads "
       "it",
       has_tsc ? "echo tsc > " + folder + "current_clocksource; for good, boot with clocksource=tsc"
               : "the kernel does not trust this processor's counter (journalctl -k -g tsc says "
                 "why); look in the firmware or the hypervisor for an invariant TSC"});
}

void examine_governors(const Machine& machine, Findings& found) {
  std::map<std::string, std::string> slow;  // governors, and their processors
  for (const std::string& name : machine.list("/sys/devices/system/cpu")) {
    const auto governor =
        machine.read("/sys/devices/system/cpu/" + name + "/cpufreq/scaling_governor");
    if (!governor || *governor == "performance") continue;
    std::string& processors = slow[*governor];
    processors += (processors.empty() ? "" : ", ") + name;
  }
  for (const auto& [governor, processors] : slow) {
    std::string what = "the frequency governor of " + processors;
    what += " is " + governor;
    found.push_back(
        {"governor", std::move(what),
         "a processor that has slept begins slowly, so that the first sample after a "
         "pause is late",
         "echo performance | tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor"});
  }
}

void examine_memory(const Machine& machine, Findings& found) {
  const auto available = machine.field("/proc/meminfo", "MemAvailable");
  if (!available || *available * 1024 >= kMemory) return;
  found.push_back({"memory",
                   "the machine has " + std::to_string(*available) + " KiB of memory left",
                   "samples and queues are shared memory: where none is left, ports cannot be "
                   "opened or connected, and the kernel ends processes",
                   "ps -eo pid,rss,comm --sort=-rss | head, and end what need not run"});
}

// systemd's unit is that of the default instance.
bool has_unit(const std::string& instance) { return instance == wire::kDefaultInstance; }

std::string start_of_daemon(const std::string& instance) {
  return has_unit(instance) ? "systemctl start arbiterd, or arbiterd --model FILE"
                            : "arbiterd --model FILE --instance " + instance;
}

std::string restart_of_daemon(const std::string& instance) {
  return has_unit(instance)
             ? "systemctl restart arbiterd, or start the daemon again as it was started"
             : "end the daemon, and start it again as it was started, with --instance " + instance;
}

// Whose socket that is: "base" of "/run/arbiter/base.link".
std::string instance_of(const std::string& socket) {
  return std::filesystem::path(socket).stem().string();
}

class Processes {
 public:
  Processes(const Machine& machine, std::string instance, Findings& found)
      : machine_(machine), instance_(std::move(instance)), found_(found) {}

  void examine(const std::string& name, std::int32_t pid, bool is_daemon) {
    const std::string process = std::to_string(pid);
    if (pid <= 0 || !seen_.insert(pid).second) return;
    if (machine_.is_stopped(process)) {
      found_.push_back({"stopped", name + " is stopped",
                        is_daemon ? "no port can be opened, and no model changed"
                                  : "it neither publishes nor takes, and its sources go inactive "
                                    "when their T has passed",
                        "kill -CONT " + process});
    }
    const auto program = machine_.read_link("/proc/" + process + "/exe");
    if (program && program->ends_with(" (deleted)")) {
      found_.push_back(
          {"replaced-program",
           "the program of " + name + " has been replaced since it was started: " + *program,
           "it still runs the old version, which programs of the new one may not "
           "understand",
           is_daemon ? restart_of_daemon(instance_) + "; components go on meanwhile"
                     : "start it again"});
    }
    const auto ours = machine_.read_link("/proc/self/ns/time");
    const auto its = machine_.read_link("/proc/" + process + "/ns/time");
    if (ours && its && *ours != *its) {
      found_.push_back(
          {"time-namespace", name + " runs in another time namespace than this program",
           "if its monotonic clock is another, activity that it begins is over already "
           "or does not end",
           "run it in the same time namespace: without --time in unshare or in the "
           "container's settings"});
    }
  }

 private:
  const Machine& machine_;
  const std::string instance_;
  Findings& found_;
  std::set<std::int32_t> seen_;
};

void add_strangers(const wire::Status& status, Findings& found) {
  for (const wire::StrangerStatus& stranger : status.strangers) {
    found.push_back({"stranger",
                     stranger.node + " (pid " + std::to_string(stranger.pid) + ", user " +
                         std::to_string(stranger.user) +
                         ") belongs to a daemon whose state is lost: " + stranger.why,
                     "its ports are not connected to those of other components, and it commands "
                     "whom it commanded before",
                     "start that component again"});
  }
}

Finding silence(const std::string& text, const std::string& instance) {
  if (text.starts_with("no arbiterd of instance")) {
    return {"no-daemon", text, "no port can be opened, and no model changed",
            start_of_daemon(instance)};
  }
  const auto command = text.find("kill -CONT ");  // at the end, where it is seen to be stopped
  return {"silent-daemon", text, "no port can be opened, and no model changed",
          command != std::string::npos
              ? text.substr(command)
              : "kill -CONT its process if it is stopped (ps -o pid,stat,wchan -C arbiterd); "
                "otherwise " +
                    restart_of_daemon(instance) + ": components go on meanwhile"};
}

// By what the daemon says when it turns us away.
Finding refusal(const std::string& text, const std::string& instance) {
  if (text.find("speaks version") != std::string::npos) {
    return {"other-version", "this program and the daemon are of different versions: " + text,
            "no version understands another: components of this version cannot join either",
            "start the daemon again, with arbiterd of the version that `arbiter --version` prints"};
  }
  return {"refused", text, "as this user you see nothing of the instance, or nobody does",
          "where a policy keeps you out, add a line to it: allow user NAME observe; otherwise look "
          "into the daemon's log" +
              std::string(has_unit(instance) ? ": journalctl -u arbiterd" : "")};
}

}  // namespace

Findings examine_machine(const Machine& machine) {
  Findings found;
  examine_limits(machine, found);
  examine_clock(machine, found);
  examine_governors(machine, found);
  examine_memory(machine, found);
  return found;
}

Findings examine_meeting_places() {
  Findings found;
  for (const std::string& directory : wire::client_directories()) {
    if (wire::is_a_strangers(directory)) {
      found.push_back({"strangers-directory",
                       directory + " belongs to a user whose daemons are not trusted",
                       "components do not look into it, so that they do not find a daemon there",
                       "start the daemon as root, as arbiter or as this user; if `ss -xl` shows "
                       "nobody who listens there, you may also rm -r " +
                           directory + ": a daemon that runs there would lose its state"});
      continue;
    }
    for (const std::string& path : abandoned_sockets(directory)) {
      if (path.ends_with(".link")) {
        found.push_back(
            {"stale-socket", "nobody listens at " + path,
             "the link of instance " + instance_of(path) +
                 " was killed there: nothing of that instance crosses between this host and others",
             "start arbiter-link --instance " + instance_of(path) +
                 ", or if it is not needed any more: rm " + path});
        continue;
      }
      found.push_back(
          {"stale-socket", "nobody listens at " + path,
           "the daemon of instance " + instance_of(path) +
               " was killed there; until the next one comes, components of that instance go on "
               "with the last model, and new ones find no daemon",
           "start the daemon of that instance, or if it is not needed any more: rm " + path});
    }
  }
  return found;
}

Findings examine_daemon(const wire::Caller& caller, std::optional<wire::Status>& status) {
  Findings found;
  try {
    const wire::Welcome welcome = wire::join(caller);
    const auto fault = wire::find_fault_in_clock(welcome.received.message, welcome.asked);
    if (!fault.empty()) {
      found.push_back({"clock", fault, "components that are started from here cannot join",
                       "run both in the same time namespace"});
    }
    for (const auto& path : wire::other_daemons(caller.instance, welcome.directory)) {
      const std::string met = welcome.directory + "/" + caller.instance + ".sock";
      found.push_back({"second-daemon", wire::describe_second_daemon(caller.instance, met, path),
                       "which of the two a component meets depends on its environment "
                       "(XDG_RUNTIME_DIR, TMPDIR)",
                       "arbiter stop, with the environment of the one that is not wanted"});
    }
    wire::Call call(caller);
    wire::Message question;
    question.kind = wire::MessageKind::kStatus;
    const auto answer = call.ask(question, caller.answer_time);
    status = wire::read_status(wire::read_document(answer.descriptors[0]));
  } catch (const wire::RefusedError& error) {
    found.push_back(refusal(error.what(), caller.instance));
  } catch (const wire::CallError& error) {
    found.push_back(silence(error.what(), caller.instance));
  } catch (const wire::DocumentError& error) {
    found.push_back(
        {"other-version", std::string("the daemon's status cannot be read: ") + error.what(),
         "this program and the daemon may be of different versions",
         "start the daemon again, with arbiterd of the version that `arbiter --version` "
         "prints"});
  }
  return found;
}

Findings examine_processes(const Machine& machine, const wire::Status& status) {
  Findings found;
  if (!machine.has_process(status.pid)) {
    found.push_back(
        {"no-daemon",
         "no daemon runs on the machine of --root: the one that answers here, with pid " +
             std::to_string(status.pid) + ", is not among its processes",
         "the processes of the daemon and of the components cannot be examined",
         "leave out --root, or copy /proc and /sys while the daemon runs"});
  }
  const auto files = machine.limit(std::to_string(status.pid), "Max open files");
  if (files && *files < kDaemonDescriptors) {
    found.push_back(
        {"daemon-descriptors",
         "the daemon may have " + std::to_string(*files) + " descriptors (RLIMIT_NOFILE)",
         "it needs a few for each component and source, and turns newcomers away when "
         "none are left",
         "LimitNOFILE=65536 in the daemon's unit, or ulimit -n 65536 before it is "
         "started"});
  }
  Processes processes(machine, status.instance, found);
  processes.examine("arbiterd (pid " + std::to_string(status.pid) + ")", status.pid, true);
  const auto examine = [&](const auto& ports) {
    for (const auto& port : ports) {
      if (port.open) {
        const wire::Component& component = port.open->component;
        processes.examine(process_text(component), component.pid, false);
      } else if (port.away_pid) {
        processes.examine(
            "the component of " + port.name + " (pid " + std::to_string(*port.away_pid) + ")",
            *port.away_pid, false);
      }
    }
  };
  examine(status.sources);
  examine(status.inputs);
  add_strangers(status, found);
  return found;
}

const std::vector<std::string>& finding_codes() {
  static const std::vector<std::string> codes{"locked-memory",
                                              "realtime-priority",
                                              "descriptors",
                                              "clock-source",
                                              "governor",
                                              "memory",
                                              "strangers-directory",
                                              "stale-socket",
                                              "no-daemon",
                                              "silent-daemon",
                                              "other-version",
                                              "refused",
                                              "clock",
                                              "second-daemon",
                                              "daemon-descriptors",
                                              "stopped",
                                              "replaced-program",
                                              "time-namespace",
                                              "stranger",
                                              "model-refused",
                                              "dead-component",
                                              "type-mismatch",
                                              "cannot-deliver",
                                              "opening-refused",
                                              "port-trouble",
                                              "near-name",
                                              "slow-publisher",
                                              "silent-link",
                                              "link-waits",
                                              "port-on-two-hosts",
                                              "source-on-two-hosts",
                                              "shared-host-name",
                                              "host-gone",
                                              "deaf-host"};
  return codes;
}

}  // namespace arbiter::watch
