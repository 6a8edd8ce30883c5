// Which host answers `arbiter why`.
#include <algorithm>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "cli/why_elsewhere.hpp"
#include "command_line/shell_word.hpp"
#include "rules/text/names.hpp"
#include "watch/port.hpp"
#include "wire/hosts.hpp"

namespace arbiter::cli {

std::optional<std::string> host_that_decides(const std::string& port,
                                             const wire::HostsDocument& hosts) {
  std::vector<std::string> found;
  for (const wire::HostStatus& host : hosts.hosts) {
    const bool has_it =
        std::find(host.inputs.begin(), host.inputs.end(), port) != host.inputs.end();
    if (!has_it || !host.is_up) continue;
    if (host.is_this) return std::nullopt;
    found.push_back(host.host);
  }
  if (found.size() > 1) {
    throw watch::WatchError(port + " is open on the hosts " + rules::enumerate(found) +
                            ", and each decides it for itself: name one with --host");
  }
  return found.empty() ? std::nullopt : std::optional(found.front());
}

void write_others_with_port(std::ostream& out, const std::string& port, bool is_open,
                            const std::vector<std::string>& others) {
  for (const std::string& host : others) {
    out << "  ! it is " << (is_open ? "also " : "") << "open on host " << host
        << (is_open ? ", and each of them decides it by itself: open it on one only; "
                    : ", which decides it for its component: ")
        << "arbiter why " << command_line::shell_word(port) << " --host "
        << command_line::shell_word(host) << '\n';
  }
}

void require_one_host(const std::string& name, const wire::HostsDocument& hosts) {
  const auto count = std::count_if(hosts.hosts.begin(), hosts.hosts.end(), [&](const auto& each) {
    return each.is_up && each.host == name;
  });
  if (count < 2) return;
  throw watch::WatchError(std::to_string(count) + " machines are called " + name +
                          ": give the link of each its own --host");
}

}  // namespace arbiter::cli
