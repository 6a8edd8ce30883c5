// Leaves out one order of the sources after the other, and sees that a case turns red each time:
// an acquire or a release becomes relaxed, a fence nothing. Prints a table: which order, what was
// left out, the case that turned red, and how.
//
//   weaken_each [--jobs N] [--met FILE] [--only TEXT]
//
// Exits with 1, naming it, if one may be left out unnoticed. `--met` writes down the lines that
// were met, for .ci/weaken to compare with all that the sources have; `--only` leaves out only
// those orders in whose row TEXT occurs.
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/explore/case.hpp"

namespace arbiter::explore {
namespace {

// Most orders are missed early: look everywhere a little before looking anywhere far. The last is
// what the case itself says.
constexpr Limits kLevels[] = {{1, 1, 1}, {2, 1, 1}, {2, 2, 1}, {9, 9, 9}};
constexpr unsigned kSeconds = 300;  // for one location

Limits least(const Limits& one, const Limits& other) {
  Limits limits = one;
  limits.preemptions = std::min(one.preemptions, other.preemptions);
  limits.stale_reads = std::min(one.stale_reads, other.stale_reads);
  limits.halts = std::min(one.halts, other.halts);
  return limits;
}

const char* name_of(Weakness kind) {
  switch (kind) {
    case Weakness::kAcquire:
      return "acquire";
    case Weakness::kRelease:
      return "release";
    case Weakness::kFence:
      return "fence";
  }
  return "?";
}

std::string short_name(const std::string& file) {
  const std::string root = ARBITER_SOURCE_DIR "/";
  return file.compare(0, root.size(), root) == 0 ? file.substr(root.size()) : file;
}

bool is_product(const Location& location) {
  const std::string file = short_name(location.file);
  for (const char* const room : {"shm/", "client/", "service/", "gateway/"}) {
    if (file.compare(0, std::strlen(room), room) == 0) return true;
  }
  return false;
}

std::string describe(const Location& location) {
  return short_name(location.file) + ":" + std::to_string(location.line) + " " +
         name_of(location.kind);
}

struct Met {
  const Case* met_by;
  std::uint64_t cost;
};
using MetBy = std::map<Location, std::vector<Met>>;

MetBy meet_all() {
  MetBy all;
  for (const Case& each : cases()) {
    std::set<Location> met;
    std::uint64_t cost = 0;
    each.body([&](const Explorer::Scenario& scenario) {
      Explorer explorer(least(each.limits, {2, 1, 1}));
      explorer.collect(met);
      const Report report = explorer.run(scenario);
      cost = report.executions;
      if (!report.failure.empty()) {
        std::fprintf(stderr, "%s fails as it is: %s\n", each.name, report.failure.c_str());
        std::exit(1);
      }
    });
    for (const Location& location : met) {
      if (is_product(location)) all[location].push_back({&each, cost});
    }
  }
  for (auto& [location, by] : all) {
    std::sort(by.begin(), by.end(),
              [](const Met& one, const Met& other) { return one.cost < other.cost; });
  }
  return all;
}

// Which case turns red, and how; empty if none does.
std::string turn_red(const Location& location, const std::vector<Met>& met_by) {
  for (const Limits& level : kLevels) {
    for (const Met& met : met_by) {
      std::string red;
      met.met_by->body([&](const Explorer::Scenario& scenario) {
        Explorer explorer(least(met.met_by->limits, level));
        explorer.weaken(location);
        const Report report = explorer.run(scenario);
        if (report.failure.empty()) return;
        red = std::string(met.met_by->name) + ": " +
              report.failure.substr(0, report.failure.find("; schedule"));
      });
      if (!red.empty()) return red;
    }
  }
  return {};
}

// In a process of its own: what is weakened may do anything.
struct Job {
  pid_t pid;
  int output;
  const Location* location;
};

Job start(const Location& location, const std::vector<Met>& met_by) {
  int ends[2];
  if (pipe(ends) != 0) std::abort();
  std::fflush(stdout);
  const pid_t pid = fork();
  if (pid < 0) std::abort();
  if (pid != 0) {
    close(ends[1]);
    return {pid, ends[0], &location};
  }
  alarm(kSeconds);
  const std::string red = turn_red(location, met_by);
  const bool written = write(ends[1], red.data(), red.size()) == static_cast<ssize_t>(red.size());
  _exit(written ? 0 : 3);
}

// True if a case turned red.
bool finish(const Job& job, int status) {
  char text[1024];
  const ssize_t length = read(job.output, text, sizeof text);
  close(job.output);
  std::string red(text, length > 0 ? static_cast<std::size_t>(length) : 0);
  if (WIFSIGNALED(status)) {
    red = WTERMSIG(status) == SIGALRM ? "" : "crashed: " + std::string(strsignal(WTERMSIG(status)));
  }
  std::printf("%-36s %s\n", describe(*job.location).c_str(),
              red.empty() ? "STAYS GREEN" : red.c_str());
  return !red.empty();
}

int weaken_each(unsigned jobs, const char* met_file, const std::string& only) {
  MetBy all = meet_all();
  if (met_file != nullptr) {
    std::ofstream file(met_file);
    for (const auto& [location, by] : all) {
      file << short_name(location.file) << ':' << location.line << '\n';
    }
  }
  std::erase_if(
      all, [&](const auto& each) { return describe(each.first).find(only) == std::string::npos; });
  if (all.empty()) {
    std::printf(
        "no order to leave out: no case meets one in shm/, client/, service/ or gateway/%s\n",
        only.empty() ? "" : (" whose row says " + only).c_str());
    return 1;
  }
  std::vector<Job> running;
  std::vector<std::string> green;
  const auto wait_for_one = [&] {
    int status = 0;
    const pid_t pid = waitpid(-1, &status, 0);
    const auto job = std::find_if(running.begin(), running.end(),
                                  [pid](const Job& each) { return each.pid == pid; });
    if (job == running.end()) return;
    if (!finish(*job, status)) green.push_back(describe(*job->location));
    running.erase(job);
  };
  for (const auto& [location, by] : all) {
    if (running.size() == jobs) wait_for_one();
    running.push_back(start(location, by));
  }
  while (!running.empty()) wait_for_one();
  std::printf("%zu orders left out in turn, %zu unnoticed\n", all.size(), green.size());
  for (const std::string& each : green) std::printf("no case needs %s\n", each.c_str());
  return green.empty() ? 0 : 1;
}

}  // namespace
}  // namespace arbiter::explore

int main(int count, char** arguments) {
  unsigned jobs = 2;
  const char* met_file = nullptr;
  std::string only;
  for (int i = 1; i + 1 < count; i += 2) {
    if (std::strcmp(arguments[i], "--jobs") == 0) {
      jobs = static_cast<unsigned>(std::max(1, std::atoi(arguments[i + 1])));
    } else if (std::strcmp(arguments[i], "--met") == 0) {
      met_file = arguments[i + 1];
    } else if (std::strcmp(arguments[i], "--only") == 0) {
      only = arguments[i + 1];
    }
  }
  return arbiter::explore::weaken_each(jobs, met_file, only);
}
