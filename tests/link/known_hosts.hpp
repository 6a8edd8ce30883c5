// What links know of each other, asked for as programs do it.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <tuple>
#include <vector>

#include "shm/activity.hpp"
#include "tests/cli/arbiter_program.hpp"
#include "tests/link/scene.hpp"
#include "wire/hosts.hpp"
#include "wire/link_call.hpp"

namespace arbiter::test {

// Asks the link of that instance until it answers so. One that joins its network, or whose places
// are all taken, does not answer yet.
inline wire::HostsDocument await_hosts(
    const std::string& instance, const std::function<bool(const wire::HostsDocument&)>& is_so) {
  wire::HostsDocument hosts;
  await([&] {
    try {
      hosts = wire::read_hosts(wire::LinkCall(instance).ask({"", "hosts"}));
    } catch (const wire::CallError&) {
      return false;
    }
    return is_so(hosts);
  });
  return hosts;
}
inline wire::HostsDocument hosts_of(const std::string& instance) {
  return await_hosts(instance, [](const wire::HostsDocument&) { return true; });
}
inline wire::HostsDocument await_host(const std::string& instance, const std::string& other) {
  return await_hosts(instance, [&](const wire::HostsDocument& hosts) {
    const wire::HostStatus* const found = hosts.find_host(other);
    return found != nullptr && found->is_up;
  });
}

// Until that instance can ask the other host, and knows how many input ports it has open. What one
// host knows of another says nothing of what that one knows of it.
inline void await_inputs(const std::string& instance, const std::string& other, std::size_t count) {
  await_hosts(instance, [&](const wire::HostsDocument& hosts) {
    const wire::HostStatus* const found = hosts.find_host(other);
    return found != nullptr && found->is_up && found->inputs.size() == count;
  });
}

// Equal to another: no host has been lost or found in between. On a busy machine a lease may end.
using Presences = std::vector<std::tuple<std::string, shm::Nanoseconds, bool>>;

inline Presences presences_at(const std::string& host) {
  Presences all;
  for (const auto& each : hosts_of(host).hosts) {
    all.emplace_back(each.host, each.since, each.is_up);
  }
  return all;
}

inline ProgramResult run_arbiter(const std::string& instance, std::vector<std::string> arguments) {
  arguments.insert(arguments.end(), {"--instance", instance});
  return arbiter(arguments);
}

// Until it succeeds: on a busy machine a host may not answer within its second.
inline ProgramResult run_answered(const std::string& instance,
                                  const std::vector<std::string>& arguments) {
  ProgramResult result;
  await([&] {
    result = run_arbiter(instance, arguments);
    return result.exit_code == 0;
  });
  return result;
}

}  // namespace arbiter::test
