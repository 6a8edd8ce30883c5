#include "cli/other_hosts.hpp"

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <stdexcept>
#include <utility>

#include <nlohmann/json.hpp>

#include "shm/utf8.hpp"
#include "watch/imported.hpp"
#include "watch/past.hpp"
#include "watch/span.hpp"
#include "wire/document.hpp"
#include "wire/link_call.hpp"

namespace arbiter::cli {
namespace {

constexpr std::chrono::milliseconds kPatience{1000};

// Documents are not nested deeply: wire::parse_document() sees to it.
void make_printable(nlohmann::json& value) {
  if (value.is_string()) {
    value = shm::printable(value.get_ref<const std::string&>());
  } else if (value.is_structured()) {
    for (nlohmann::json& each : value) make_printable(each);
  }
}

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

wire::Status read_status_of_host(const std::string& text) {
  nlohmann::json document = wire::parse_document(text);
  make_printable(document);
  return wire::read_status(document.dump());
}

bool has_others(const std::optional<wire::HostsDocument>& hosts) {
  return hosts && std::any_of(hosts->hosts.begin(), hosts->hosts.end(),
                              [](const auto& each) { return each.is_up && !each.is_this; });
}

OtherHosts statuses_of_other_hosts(const std::string& instance,
                                   std::chrono::milliseconds patience) {
  OtherHosts others;
  try {
    const auto hosts = wire::read_hosts(wire::LinkCall(instance, patience).ask({"", "hosts"}));
    others.here = shm::printable(hosts.host);
    if (!has_others(hosts)) return others;
    for (const auto& answer :
         wire::LinkCall(instance, patience).ask_hosts({wire::kAllHosts, "status"})) {
      const bool is_here = answer.host == hosts.host;
      if (is_here || answer.outcome != wire::HostOutcome::kAnswered) continue;
      others.answered.push_back({shm::printable(answer.host), read_status_of_host(answer.text)});
    }
  } catch (const std::runtime_error&) {
    // What is not known of other hosts, nothing is said of.
  }
  return others;
}

std::vector<std::string> others_with_port(const std::string& port, const wire::HostsDocument& hosts,
                                          const std::string& but) {
  std::vector<std::string> others;
  for (const wire::HostStatus& each : hosts.hosts) {
    const bool has_it =
        std::find(each.inputs.begin(), each.inputs.end(), port) != each.inputs.end();
    if (has_it && each.is_up && each.host != but) others.push_back(shm::printable(each.host));
  }
  return others;
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

std::string counts_text(const wire::ImportStatus& import) {
  std::string text;
  const auto count = [&](std::uint64_t number, const char* what) {
    if (number != 0) text += ", " + std::to_string(number) + what;
  };
  count(import.lost, " lost");
  count(import.without_sample, " without their samples");
  count(import.late, " late");
  count(import.withheld, " withheld");
  return text;
}

Ages ages_in(const watch::Picture& picture, const shm::DecisionMemory& memory) {
  Ages ages;
  for (const auto& [source, word] : picture.words) {
    const auto age = picture.age_of(source);
    if (age) ages[memory.source_name(source)] = watch::span_text(*age) + " ago";
  }
  return ages;
}

Ages ages_in(const watch::Instance& instance) {
  const shm::DecisionMemory& memory = *instance.memory();
  for (;;) {
    const watch::Picture picture = watch::take_picture(memory, watch::all_sources);
    Ages ages = ages_in(picture, memory);
    if (memory.tables().is_whole(picture.snapshot)) return ages;
  }
}

bool is_left(const wire::Status& here, const std::string& source) {
  const wire::SourceStatus* const found = here.find_source(source);
  const bool is_there = found != nullptr && (found->open || found->away_pid);
  return !is_there && watch::death_of(here, watch::kOutputEnd, source) == nullptr;
}

void write_imports(std::ostream& out, const std::vector<std::string>& sources,
                   const wire::Status& here, const wire::HostsDocument& hosts, const Ages& ages) {
  bool is_first = true;
  const auto begin_line = [&](const std::string& source) {
    out << (std::exchange(is_first, false) ? "\nFrom other hosts:\n" : "") << "  "
        << shm::printable(source);
  };
  for (const std::string& source : sources) {
    const wire::ImportStatus* const import = hosts.find_import(source);
    if (import == nullptr || import->is_open_here) continue;
    const wire::SourceStatus* const found = here.find_source(source);
    std::string from = found == nullptr ? "" : watch::host_of(*found);
    const bool is_open = !from.empty();
    if (from.empty() || from == watch::kUnknownHost) from = import->host;
    const wire::HostStatus* const host = hosts.find_host(from);
    if (is_open) {
      begin_line(source);
      out << "  from host " << shm::printable(from) << ", round trip "
          << round_trip_text(host == nullptr ? std::nullopt : host->round_trip);
      const auto age = ages.find(source);
      if (age != ages.end()) out << ", " << age->second;
      out << counts_text(*import) << '\n';
    } else if (import->is_gone() && is_left(here, source)) {
      begin_line(source);
      out << "  came from host " << shm::printable(from)
          << (host != nullptr && host->is_up ? ", which does not offer it now\n"
                                             : ", which is gone (arbiter hosts)\n");
    }
  }
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
