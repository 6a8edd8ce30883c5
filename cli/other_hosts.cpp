#include "cli/other_hosts.hpp"

#include <cstdio>
#include <iostream>
#include <stdexcept>

#include "shm/utf8.hpp"
#include "wire/link_call.hpp"

namespace arbiter::cli {
namespace {

constexpr std::chrono::milliseconds kPatience{1000};

}  // namespace

std::optional<wire::HostsDocument> hosts_if_linked(const std::string& instance) {
  try {
    return wire::read_hosts(wire::LinkCall(instance, kPatience).ask({"", "hosts"}));
  } catch (const wire::NoLinkError&) {
    return std::nullopt;
  } catch (const std::runtime_error& error) {
    std::cerr << "arbiter: nothing is known of other hosts: " << error.what() << '\n';
    return std::nullopt;
  }
}

void write_port_errors(std::ostream& out, const std::optional<wire::HostsDocument>& hosts) {
  if (!hosts) return;
  for (const wire::HostDisagreement& each : hosts->disagreements) {
    if (each.is_error) out << "\nERROR: " << shm::printable(each.text) << '\n';
  }
}

std::string round_trip_text(const std::optional<shm::Nanoseconds>& round_trip) {
  if (!round_trip) return "-";
  char text[32];
  std::snprintf(text, sizeof text, "%.2f ms", static_cast<double>(*round_trip) / 1e6);
  return text;
}

std::string model_text(const wire::HostStatus& host, const wire::HostStatus* here) {
  if (!host.has_daemon) return host.is_up ? "no daemon" : "-";
  if (!host.model) return "no model";
  std::string text = shm::printable(host.model->name);
  if (host.model->digest.empty()) return text;
  text += ' ' + shm::printable(host.model->digest).substr(0, 8);
  const bool is_other = here != nullptr && here->model && !here->model->digest.empty() &&
                        here->model->digest != host.model->digest;
  return text + (is_other ? ", differs" : "");
}

}  // namespace arbiter::cli
