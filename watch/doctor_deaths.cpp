// Doctor: components that died, and that nobody has started again.
#include <algorithm>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "rules/text/names.hpp"
#include "shm/clock.hpp"
#include "watch/doctor.hpp"
#include "watch/process.hpp"
#include "watch/span.hpp"

namespace arbiter::watch {
namespace {

bool is_left(const auto* port) {
  return port != nullptr && port->mentioned && !port->open && !port->away_pid;
}

// What the model knows of those ports, and nobody has opened since; and no later death has told of.
struct Left {
  std::vector<std::string> ports;
  std::vector<std::string> active;  // those whose last arrival counts for ever
};

Left left_by(const wire::Status& status, const wire::DeathStatus& death,
             std::set<std::string>& told) {
  // Whoever had it last has closed it in good order, or died as well.
  const auto is_settled = [&](const std::string& port) {
    return std::find(death.opened_since.begin(), death.opened_since.end(), port) !=
           death.opened_since.end();
  };
  Left left;
  for (const std::string& port : death.outputs) {
    const wire::SourceStatus* source = status.find_source(port);
    if (is_settled(port) || !is_left(source) || !told.insert(port).second) continue;
    left.ports.push_back(port);
    if (source->active && source->timeout == shm::kForever) left.active.push_back(port);
  }
  for (const std::string& port : death.inputs) {
    if (is_settled(port)) continue;
    if (is_left(status.find_input(port)) && told.insert(port).second) left.ports.push_back(port);
  }
  return left;
}

}  // namespace

Findings examine_deaths(const wire::Status& status) {
  Findings found;
  std::set<std::string> told;
  for (const wire::DeathStatus& death : status.deaths) {
    const auto [ports, active] = left_by(status, death, told);
    if (ports.empty()) continue;
    Finding finding{"dead-component",
                    process_text(death) + " died " + span_text(shm::monotonic_now() - death.at) +
                        " ago, and nobody has " + rules::enumerate(ports) + " open",
                    "a source that nobody publishes is inactive once its T has passed, and at an "
                    "input port that nobody has open nothing is taken",
                    "start that component again"};
    if (!active.empty()) {
      finding.why = "the activity of " + rules::enumerate(active) +
                    " lasts for ever: whom it commands gets nothing, and whom it inhibits stays "
                    "kept out";
      finding.mend += ", or: arbiter deactivate " + active.front();
    }
    found.push_back(std::move(finding));
  }
  return found;
}

}  // namespace arbiter::watch
