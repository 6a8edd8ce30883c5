#include "service/models/preparation.hpp"

#include <systemd/sd-daemon.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <set>
#include <stdexcept>
#include <utility>

#include <nlohmann/json.hpp>

#include "service/log/log.hpp"
#include "service/models/comparison.hpp"
#include "service/policy/unmatched.hpp"
#include "shm/limits.hpp"

namespace arbiter::service {
namespace {

constexpr std::chrono::seconds kEvery{1};
constexpr std::chrono::seconds kEveryInLog{2};
// Longer than reading and extracting take, during which nothing is told.
constexpr int kAtMost = 30;

NamedPorts named_ports(const std::vector<ModelPointer>& models) {
  NamedPorts ports;
  for (const ModelPointer& model : models) {
    const rules::CompiledModel& compiled = model->compiled;
    ports.outputs.insert(ports.outputs.end(), compiled.sources.begin(), compiled.sources.end());
    for (const rules::CompiledPort& port : compiled.ports) ports.inputs.push_back(port.port);
  }
  return ports;
}

// Those of all models have a place in the memory of the instance, be they in force or not.
void check_count(const std::vector<std::string_view>& names, std::size_t limit,
                 const std::string& what, Findings& findings) {
  const std::size_t count = std::set(names.begin(), names.end()).size();
  if (count <= limit) return;
  findings.add_failure("limit-exceeded: the models together name " + std::to_string(count) + " " +
                       what + ", and an instance has at most " + std::to_string(limit) +
                       "; give it fewer models, or let them name fewer");
}

// Where patterns fit no port of any of the models.
void note_patterns(const Policy& policy, NamedPorts ports, Findings& findings) {
  rules::Diagnostics unmatched;
  find_unmatched(policy, std::move(ports), unmatched);
  findings.add(kOfPolicy, std::move(unmatched));
}

}  // namespace

Reading read_files(const std::vector<NamedFiles>& files, const Gate& gate, const Proving& proving,
                   const std::stop_token& stop) {
  Reading reading;
  reading.findings = Findings(proving.is_strict);
  reading.policy = gate.read(reading.findings);
  if (reading.findings.has_errors()) reading.policy.reset();  // what it warns of, --strict refuses
  reading.models = read_models(files, proving, stop, reading.findings);
  if (reading.findings.has_errors()) return reading;
  NamedPorts ports = named_ports(reading.models);
  check_count(ports.outputs, shm::kMaxSources, "sources", reading.findings);
  check_count(ports.inputs, shm::kMaxInputPorts, "input ports", reading.findings);
  if (reading.policy) note_patterns(*reading.policy, std::move(ports), reading.findings);
  return reading;
}

ModelPointer find_model(const std::vector<ModelPointer>& models, const std::string& name) {
  const auto found = std::find_if(models.begin(), models.end(),
                                  [&](const auto& model) { return model->name == name; });
  if (found != models.end()) return *found;
  return models.empty() ? nullptr : models.front();
}

std::string changes_between(const Model& before, const Model& after, std::uint64_t steps,
                            const std::stop_token& stop) {
  nlohmann::json changes;
  try {
    changes = changes_json(before.compiled, after.compiled, steps, stop);
  } catch (const rules::Stopped&) {
    throw;
  } catch (const std::exception& error) {
    const std::string why_not = std::string("not compared: ") + error.what();
    changes = {{"summary", why_not}, {"text", why_not + '\n'}, {"diff", nullptr}};
  }
  // Names may be any bytes; JSON may not.
  return changes.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

StatusLine::StatusLine(std::string instance, std::function<Clock::time_point()> now)
    : instance_(std::move(instance)),
      now_(std::move(now)),
      has_manager_(std::getenv("NOTIFY_SOCKET") != nullptr),
      next_(now_() + (has_manager_ ? kEvery : kEveryInLog)) {}

StatusLine::~StatusLine() {
  if (has_told_) sd_notifyf(0, "STATUS=instance %s", instance_.c_str());
}

rules::Budget::Watch StatusLine::watch() {
  return [this](const rules::Progress& progress) {
    if (now_() < next_ || (!has_manager_ && progress.of == 0)) return;
    next_ = now_() + (has_manager_ ? kEvery : kEveryInLog);
    if (!has_manager_) {
      log::info("{}: {} of {} ports ({})", progress.stage, progress.done, progress.of,
                progress.name);
      return;
    }
    has_told_ = true;
    sd_notifyf(0, "STATUS=%s: %zu of %zu ports (%s)\nEXTEND_TIMEOUT_USEC=%d000000",
               progress.stage.c_str(), progress.done, progress.of, progress.name.c_str(), kAtMost);
  };
}

}  // namespace arbiter::service
