// Doctor: components that died, and that nobody has started again.
#include <algorithm>
#include <set>

#include "rules/text/names.hpp"
#include "shm/clock.hpp"
#include "watch/doctor.hpp"
#include "watch/process.hpp"
#include "watch/span.hpp"

namespace arbiter::watch {
namespace {

bool is_open(const auto* port) { return port != nullptr && (port->open || port->away_pid); }

// The ports of those names that nobody has, and that no later death has told of.
std::vector<std::string> left_by(const wire::Status& status, const wire::DeathStatus& death,
                                 std::set<std::string>& told) {
  std::vector<std::string> ports;
  const auto add = [&](const std::string& port, bool is_open) {
    if (!is_open && told.insert(port).second) ports.push_back(port);
  };
  for (const std::string& port : death.outputs) add(port, is_open(status.find_source(port)));
  for (const std::string& port : death.inputs) add(port, is_open(status.find_input(port)));
  return ports;
}

}  // namespace

Findings examine_deaths(const wire::Status& status) {
  Findings found;
  std::set<std::string> told;
  for (const wire::DeathStatus& death : status.deaths) {
    const std::vector<std::string> ports = left_by(status, death, told);
    if (ports.empty()) continue;
    found.push_back({"dead-component",
                     process_text(death) + " died " + span_text(shm::monotonic_now() - death.at) +
                         " ago, and nobody has opened " + rules::enumerate(ports) + " since",
                     "a source that nobody publishes is inactive once its T has passed, and at an "
                     "input port that nobody has open nothing is taken",
                     "start that component again"});
  }
  return found;
}

}  // namespace arbiter::watch
