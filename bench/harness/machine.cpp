#include "bench/harness/machine.hpp"

#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <sstream>

#include "bench/harness/build_info.hpp"
#include "bench/harness/cpu.hpp"

namespace arbiter::bench {
namespace {

const char* const kCpus = "/sys/devices/system/cpu/";
const char* const kDmi = "/sys/class/dmi/id/";

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\n");
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(" \t\n") - first + 1);
}

// The chosen one of "always [madvise] never".
std::string chosen(const std::string& choices) {
  const auto open = choices.find('[');
  const auto close = choices.find(']');
  if (open == std::string::npos || close == std::string::npos || close < open) return choices;
  return choices.substr(open + 1, close - open - 1);
}

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) / 1e6;
}

// This process and those of its children that have ended, and theirs.
double own_time_s() {
  double sum = 0;
  for (const auto who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    ::getrusage(who, &usage);
    sum += seconds(usage.ru_utime) + seconds(usage.ru_stime);
  }
  return sum;
}

bool can_pin() {
  cpu_set_t before;
  CPU_ZERO(&before);
  if (::sched_getaffinity(0, sizeof before, &before) != 0 || processors().empty()) return false;
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(processors().front(), &one);
  const bool can = ::sched_setaffinity(0, sizeof one, &one) == 0;
  ::sched_setaffinity(0, sizeof before, &before);
  return can;
}

std::string percent(double share) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f %%", 100 * share);
  return text;
}

std::string now_as_text() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  ::gmtime_r(&now, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M UTC", &parts);
  return text;
}

void add_build(nlohmann::json& facts) {
  const BuildInfo build = build_info();
  facts["arbiter"] = build.version + (build.commit.empty() ? "" : ", commit " + build.commit);
  facts["compiler"] = build.compiler;
  facts["build"] = build.type + ":" + build.flags;
  facts["libraries"] = build.libraries;
}

}  // namespace

Machine::Machine(std::string root) : root_(std::move(root)) {}

std::string Machine::line_of(const std::string& path) const {
  std::ifstream stream(root_ + path);
  std::string line;
  std::getline(stream, line);
  return trimmed(line);
}

std::string Machine::cpuinfo(const std::string& key) const {
  std::ifstream stream(root_ + "/proc/cpuinfo");
  for (std::string line; std::getline(stream, line);) {
    const auto colon = line.find(':');
    if (colon != std::string::npos && trimmed(line.substr(0, colon)) == key) {
      return trimmed(line.substr(colon + 1));
    }
  }
  return "";
}

bool Machine::has_hypervisor() const {
  return (" " + cpuinfo("flags") + " ").find(" hypervisor ") != std::string::npos;
}

std::string Machine::virtualisation() const {
  if (!has_hypervisor()) return "none";
  const std::string maker = line_of(kDmi + std::string("sys_vendor"));
  const std::string product = line_of(kDmi + std::string("product_name"));
  const std::string name = trimmed(maker + " " + product);
  return "virtual machine" + (name.empty() ? "" : " (" + name + ")");
}

std::string Machine::governor() const {
  return line_of(std::string(kCpus) + "cpu0/cpufreq/scaling_governor");
}

int Machine::processors_in(const std::string& list) {
  int count = 0;
  std::istringstream stream(list);
  for (std::string part; std::getline(stream, part, ',');) {
    int first = 0;
    int last = 0;
    const int read = std::sscanf(part.c_str(), "%d-%d", &first, &last);
    if (read == 1) count += 1;
    if (read == 2 && last >= first) count += last - first + 1;
  }
  return count;
}

// user nice system idle iowait irq softirq steal guest guest_nice; the last two are in the first.
ProcessorTime Machine::processor_time() const {
  std::istringstream stream(line_of("/proc/stat"));
  std::string name;
  std::array<double, 8> ticks{};
  stream >> name;
  for (double& each : ticks) stream >> each;
  const auto per_second = static_cast<double>(::sysconf(_SC_CLK_TCK));
  ProcessorTime time;
  time.busy_s = (ticks[0] + ticks[1] + ticks[2] + ticks[5] + ticks[6]) / per_second;
  time.steal_s = ticks[7] / per_second;
  time.total_s = time.busy_s + time.steal_s + (ticks[3] + ticks[4]) / per_second;
  return time;
}

double Machine::load() const {
  std::istringstream stream(line_of("/proc/loadavg"));
  double load = 0;
  stream >> load;
  return load;
}

nlohmann::json Machine::describe() const {
  const auto or_unknown = [](const std::string& text) { return text.empty() ? "unknown" : text; };
  const auto or_none = [](const std::string& text) { return text.empty() ? "none" : text; };
  const std::string cpus = kCpus;
  const std::string smt = line_of(cpus + "smt/active");
  return {
      {"processor", or_unknown(cpuinfo("model name"))},
      {"processors", processors_in(line_of(cpus + "online"))},
      {"SMT", smt.empty()  ? "unknown"
              : smt == "1" ? "on"
                           : "off"},
      {"virtualised", virtualisation()},
      {"kernel", or_unknown(line_of("/proc/sys/kernel/osrelease"))},
      {"clock source",
       or_unknown(line_of("/sys/devices/system/clocksource/clocksource0/current_clocksource"))},
      {"governor", governor().empty() ? "not ours to see" : governor()},
      {"isolated processors", or_none(line_of(cpus + "isolated"))},
      {"nohz_full", or_none(line_of(cpus + "nohz_full"))},
      {"transparent hugepages",
       or_unknown(chosen(line_of("/sys/kernel/mm/transparent_hugepage/enabled")))},
  };
}

std::vector<std::string> Machine::warnings() const {
  std::vector<std::string> found;
  if (processors_in(line_of(std::string(kCpus) + "online")) < 2) {
    found.push_back("One processor: what spins takes turns with what it waits for.");
  }
  if (has_hypervisor()) {
    found.push_back(
        "A virtual machine: the tails are also the hypervisor's, and wake-ups cost more.");
  }
  if (!governor().empty() && governor() != "performance") {
    found.push_back("The frequency governor is " + governor() + ", not performance.");
  }
  const std::string clock =
      line_of("/sys/devices/system/clocksource/clocksource0/current_clocksource");
  if (clock == "hpet" || clock == "acpi_pm" || clock == "jiffies") {
    found.push_back("The clock source is " + clock + ": each look at the clock is a system call.");
  }
  return found;
}

Sharing sharing(const ProcessorTime& before, const ProcessorTime& after, double own_s) {
  const double total = after.total_s - before.total_s;
  if (total <= 0) return {};
  const double others = after.busy_s - before.busy_s - own_s;
  return {std::clamp(others / total, 0.0, 1.0),
          std::clamp((after.steal_s - before.steal_s) / total, 0.0, 1.0)};
}

std::vector<std::string> warnings_of(const Sharing& sharing) {
  constexpr double kOthers = 0.03;
  constexpr double kSteal = 0.005;
  std::vector<std::string> found;
  if (sharing.others > kOthers) {
    found.push_back("Noisy neighbours: other programs used " + percent(sharing.others) +
                    " of the processors' time meanwhile.");
  }
  if (sharing.steal > kSteal) {
    found.push_back("The hypervisor gave " + percent(sharing.steal) +
                    " of the processors' time to other machines.");
  }
  return found;
}

MachineWatch::MachineWatch()
    : before_(machine_.processor_time()),
      own_before_s_(own_time_s()),
      load_before_(machine_.load()),
      date_(now_as_text()) {}

nlohmann::json MachineWatch::finish(std::vector<std::string>& warnings) const {
  const Sharing shared = sharing(before_, machine_.processor_time(), own_time_s() - own_before_s_);
  nlohmann::json facts = machine_.describe();
  facts["date"] = date_;
  facts["usable processors"] = processors().size();
  facts["load before"] = load_before_;
  facts["used by others"] = percent(shared.others);
  facts["stolen"] = percent(shared.steal);
  facts["SCHED_FIFO"] = may_use_fifo() ? "permitted" : "not permitted";
  add_build(facts);

  const auto add = [&](const std::vector<std::string>& found) {
    warnings.insert(warnings.end(), found.begin(), found.end());
  };
  add(warnings_of(shared));
  if (processors().size() == 1) warnings.push_back("Only one processor may be used.");
  if (!can_pin()) warnings.push_back("Nothing could be pinned to a processor.");
  if (!may_use_fifo()) {
    warnings.push_back("SCHED_FIFO is not permitted: what needs it was left out.");
  }
  const BuildInfo build = build_info();
  if (!build.is_optimised) warnings.push_back("Built without optimisation.");
  if (!build.sanitizer.empty()) warnings.push_back("Built with sanitizers: " + build.sanitizer);
  add(machine_.warnings());
  return facts;
}

}  // namespace arbiter::bench
