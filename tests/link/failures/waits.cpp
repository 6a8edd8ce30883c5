#include "tests/link/failures/waits.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

namespace arbiter::failures {

// A thread that ends between two looks takes its last wait with it.
void Waits::add(unsigned host, Nanoseconds time, const std::vector<pid_t>& pids) {
  const std::vector<Look>& looks = looks_[host];
  Nanoseconds sum = looks.empty() ? 0 : looks.back().sum;
  for (const pid_t pid : pids) {
    std::error_code gone;
    const std::string tasks = "/proc/" + std::to_string(pid) + "/task";
    for (const auto& task : std::filesystem::directory_iterator(tasks, gone)) {
      std::ifstream file(task.path() / "schedstat");
      Nanoseconds ran = 0;
      Nanoseconds waited = 0;
      if (!(file >> ran >> waited)) continue;
      Nanoseconds& before = threads_[std::atoi(task.path().filename().c_str())];
      // A number may be another thread's by now.
      sum += waited >= before ? waited - before : waited;
      before = waited;
    }
  }
  note(host, time, sum);
}

Nanoseconds Waits::waited(unsigned host, Nanoseconds from, Nanoseconds to) const {
  const auto found = looks_.find(host);
  if (found == looks_.end()) return kNever;
  const std::vector<Look>& looks = found->second;
  const auto is_earlier = [](const Look& look, Nanoseconds time) { return look.time < time; };
  const auto after = std::lower_bound(looks.begin(), looks.end(), to, is_earlier);
  auto before = std::lower_bound(looks.begin(), looks.end(), from, is_earlier);
  if (after == looks.end() || before == looks.begin()) return kNever;
  --before;
  return after->sum - before->sum;
}

}  // namespace arbiter::failures
