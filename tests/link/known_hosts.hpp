// What links know of each other, asked for as programs do it.
#pragma once

#include <poll.h>

#include <functional>
#include <string>
#include <vector>

#include "tests/cli/arbiter_program.hpp"
#include "tests/link/scene.hpp"
#include "wire/hosts.hpp"
#include "wire/link_call.hpp"

namespace arbiter::test {

inline wire::HostsDocument hosts_of(const std::string& instance) {
  for (;;) {
    try {
      return wire::read_hosts(wire::LinkCall(instance).ask({"", "hosts"}));
    } catch (const wire::NoLinkError&) {  // it has just been started
      ::poll(nullptr, 0, 1);
    }
  }
}
// Asks until it is so.
inline wire::HostsDocument await_hosts(
    const std::string& instance, const std::function<bool(const wire::HostsDocument&)>& is_so) {
  for (;;) {
    wire::HostsDocument hosts = hosts_of(instance);
    if (is_so(hosts)) return hosts;
    ::poll(nullptr, 0, 5);
  }
}
inline wire::HostsDocument await_host(const std::string& instance, const std::string& other) {
  return await_hosts(instance, [&](const wire::HostsDocument& hosts) {
    const wire::HostStatus* const found = hosts.find_host(other);
    return found != nullptr && found->is_up;
  });
}

inline ProgramResult run_arbiter(const std::string& instance, std::vector<std::string> arguments) {
  arguments.insert(arguments.end(), {"--instance", instance});
  return arbiter(arguments);
}

}  // namespace arbiter::test
