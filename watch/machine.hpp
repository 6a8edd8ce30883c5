// What the kernel says of this machine and of processes on it, below /proc and /sys.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace arbiter::watch {

inline constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

enum class Capability : std::uint8_t { kIpcLock = 14, kSysNice = 23 };

// What this machine calls itself; empty: it cannot say.
[[nodiscard]] std::string host_name();

class Machine {
 public:
  // `root`: a directory that stands for "/", such as one that a test has filled.
  explicit Machine(std::string root = {}) : root_(std::move(root)) {}

  // All of these give nothing where there is no such file, or this user may not read it.
  // The beginning of a file, 64 KiB at most, without white space at its end.
  [[nodiscard]] std::optional<std::string> read(const std::string& path) const;
  [[nodiscard]] std::optional<std::string> read_link(const std::string& path) const;
  // In byte order.
  [[nodiscard]] std::vector<std::string> list(const std::string& directory) const;
  // The number behind "name:" in a file of such lines: /proc/meminfo, /proc/self/status.
  [[nodiscard]] std::optional<std::uint64_t> field(const std::string& path, const std::string& name,
                                                   int base = 10) const;

  // `process`: a pid, or "self". A soft limit as /proc/PID/limits names it: "Max open files".
  [[nodiscard]] std::optional<std::uint64_t> limit(const std::string& process,
                                                   const std::string& name) const;
  [[nodiscard]] bool has_capability(const std::string& process, Capability capability) const;
  // False only below a root of its own: /proc may hide what others run.
  [[nodiscard]] bool has_process(std::int32_t pid) const;
  // It was sent SIGSTOP, or is being debugged.
  [[nodiscard]] bool is_stopped(const std::string& process) const;

 private:
  const std::string root_;
};

}  // namespace arbiter::watch
