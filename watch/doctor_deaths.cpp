// Doctor: components that died, and that nobody has started again.
#include <string>
#include <utility>
#include <vector>

#include "rules/text/names.hpp"
#include "shm/clock.hpp"
#include "watch/doctor.hpp"
#include "watch/past.hpp"
#include "watch/process.hpp"
#include "watch/span.hpp"

namespace arbiter::watch {
namespace {

// Ports that the model knows, whose last owner has died, and nobody has opened them since.
struct Left {
  std::vector<std::string> ports;
  std::vector<std::string> active;  // those whose last arrival counts for ever
};

Left left_by(const wire::Status& status, const wire::DeathStatus& death) {
  Left left;
  for (const std::string& port : death.outputs) {
    const wire::SourceStatus* source = status.find_source(port);
    if (!is_vacant(source) || death_of(status, kOutputEnd, port) != &death) continue;
    left.ports.push_back(port);
    if (source->active && source->timeout == shm::kForever) left.active.push_back(port);
  }
  for (const std::string& port : death.inputs) {
    const bool is_last = death_of(status, kInputEnd, port) == &death;
    if (is_last && is_vacant(status.find_input(port))) left.ports.push_back(port);
  }
  return left;
}

}  // namespace

Findings examine_deaths(const wire::Status& status) {
  Findings found;
  for (const wire::DeathStatus& death : status.deaths) {
    const auto [ports, active] = left_by(status, death);
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
