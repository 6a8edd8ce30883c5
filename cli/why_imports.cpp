#include "cli/why_imports.hpp"

#include <chrono>
#include <map>
#include <optional>
#include <stdexcept>
#include <vector>

#include "cli/other_hosts.hpp"
#include "shm/clock.hpp"
#include "shm/utf8.hpp"
#include "watch/past.hpp"
#include "watch/span.hpp"
#include "wire/link_call.hpp"

namespace arbiter::cli {
namespace {

constexpr std::chrono::milliseconds kFatePatience{1000};

std::vector<std::string> sources_of(const wire::Status& here, const std::string& port) {
  std::vector<std::string> sources;
  const wire::InputStatus* const input = here.find_input(port);
  if (input == nullptr) return sources;
  for (const auto& each : input->connections) sources.push_back(each.source);
  for (const auto& each : input->senses) sources.push_back(each.source);
  return sources;
}

std::string span_since(shm::Nanoseconds time) {
  return watch::span_text(shm::monotonic_now() - time);
}

// Nothing where it does not answer.
std::optional<wire::Status> status_there(const std::string& instance, const std::string& host) {
  try {
    const auto answer = wire::LinkCall(instance, kFatePatience).ask_hosts({host, "status"}).at(0);
    if (!answer.why_not().empty()) return std::nullopt;
    return read_status_of_host(answer.text);
  } catch (const std::runtime_error&) {
    return std::nullopt;
  }
}

// Of a host that is heard.
std::string fate_there(const std::optional<wire::Status>& there, const std::string& host,
                       const std::string& source, const std::string& port) {
  const std::string came = "host " + host + ", which it came from, is heard and ";
  if (!there) {
    return came + "does not offer it now: its component closed it or died (arbiter why " + port +
           " --host " + host + " shows which)";
  }
  const wire::SourceStatus* const found = there->find_source(source);
  if (found != nullptr && (found->open || found->away_pid)) {
    return came + "has it open, but it is not imported yet";
  }
  const wire::DeathStatus* const death = watch::death_of(*there, watch::kOutputEnd, source);
  if (death != nullptr) return "on host " + host + ' ' + watch::death_text(*death, there->now);
  return came + "nobody has it open there; no death is known, so its component closed it";
}

}  // namespace

watch::Fates fates_elsewhere(const WhyOptions& options, const wire::Status& here,
                             const wire::HostsDocument& hosts) {
  watch::Fates fates;
  std::map<std::string, std::optional<wire::Status>> asked;  // by host
  for (const std::string& source : sources_of(here, options.port)) {
    const wire::ImportStatus* const import = hosts.find_import(source);
    if (import == nullptr || import->host.empty() || import->is_open_here) continue;
    if (!is_left(here, source)) continue;
    const std::string host = shm::printable(import->host);
    const wire::HostStatus* const known = hosts.find_host(import->host);
    if (known == nullptr || !known->is_up) {
      fates[source] =
          "host " + host + ", which it came from, " +
          (known == nullptr ? "is gone" : "has been gone for " + span_since(known->since)) +
          " (arbiter hosts)";
      continue;
    }
    const auto [found, is_new] = asked.try_emplace(import->host);
    if (is_new) found->second = status_there(options.instance, import->host);
    fates[source] = fate_there(found->second, host, source, options.port);
  }
  return fates;
}

void write_imports_of(std::ostream& out, const std::string& port, const wire::Status& here,
                      const wire::HostsDocument& hosts, const watch::Instance& instance) {
  write_imports(out, sources_of(here, port), here, hosts, ages_in(instance));
}

}  // namespace arbiter::cli
