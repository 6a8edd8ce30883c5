// The machine that the figures are of, and what may have spoilt them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace arbiter::bench {

// What all processors did since the machine was started, from /proc/stat.
struct ProcessorTime {
  double busy_s = 0;   // in user and kernel mode, on behalf of anybody
  double steal_s = 0;  // ready to run, but the hypervisor ran somebody else
  double total_s = 0;  // of all processors together
};

// Files are looked for below `root`, so that tests can bring a machine of their own.
class Machine {
 public:
  explicit Machine(std::string root = "");

  [[nodiscard]] ProcessorTime processor_time() const;
  // Facts that do not change while the benchmark runs: an object of texts and numbers.
  [[nodiscard]] nlohmann::json describe() const;
  // What of those facts spoils figures.
  [[nodiscard]] std::vector<std::string> warnings() const;
  [[nodiscard]] double load() const;  // the average of the last minute
  // "1-3,5" is four; the lists of processors in /sys.
  static int processors_in(const std::string& list);

 private:
  [[nodiscard]] std::string line_of(const std::string& path) const;
  [[nodiscard]] std::string cpuinfo(const std::string& key) const;
  [[nodiscard]] bool has_hypervisor() const;
  [[nodiscard]] std::string virtualisation() const;
  [[nodiscard]] std::string governor() const;

  std::string root_;
};

// How the processors were shared in a stretch of time.
struct Sharing {
  double others = 0;  // of the processors' time, what other programs used: 0 to 1
  double steal = 0;   // what the hypervisor gave to others
};
// `own_s` is what the benchmark and its children used meanwhile.
Sharing sharing(const ProcessorTime& before, const ProcessorTime& after, double own_s);
std::vector<std::string> warnings_of(const Sharing& sharing);

// Begins with the benchmark and, at its end, says all about the machine and the run.
class MachineWatch {
 public:
  MachineWatch();

  // To be called when all workers have ended: only then it is known what they used.
  [[nodiscard]] nlohmann::json finish(std::vector<std::string>& warnings) const;

 private:
  Machine machine_;
  ProcessorTime before_;
  double own_before_s_;
  double load_before_;
  std::string date_;
};

}  // namespace arbiter::bench
