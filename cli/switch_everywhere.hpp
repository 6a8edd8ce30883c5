// A switch of all hosts at once, as far as that goes: each is asked to prepare; if all have, each
// is asked to commit. Nothing is switched unless all have prepared. From the first commit on there
// is no way back, and what has become of each host is told.
//
// Thread safety: none.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "shm/activity.hpp"
#include "wire/hosts.hpp"
#include "wire/link_call.hpp"
#include "wire/switch_request.hpp"

namespace arbiter::cli {

struct HostSwitch {
  enum class Outcome : std::uint8_t {
    kSwitched,
    kNotSwitched,  // it keeps the model that it has
    kUnknown,      // it was asked to commit, and has not said what has come of it
    kLeftOut,
  };
  std::string host;
  std::string incarnation;  // of its link
  Outcome outcome = Outcome::kNotSwitched;
  bool has_prepared = false;
  shm::Nanoseconds took = 0;     // from the commit until its answer; 0: there was none
  std::uint64_t generation = 0;  // of the model in force there; 0: not known
  std::uint64_t before = 0;      // of that when it prepared
  std::string why;               // of kNotSwitched and kUnknown; for people

  // The model was in force there before: the switch has changed nothing.
  [[nodiscard]] bool had_it() const {
    return outcome == Outcome::kSwitched && generation != 0 && generation == before;
  }
};

struct SwitchEverywhere {
  bool is_committed = false;      // else none has switched
  std::string why_none;           // although all may have prepared; for people
  std::vector<HostSwitch> hosts;  // in the order of their names
  // From the first commit to the last answer, as seen here; or until a host that did not answer was
  // seen to have switched.
  shm::Nanoseconds interval = 0;

  [[nodiscard]] std::size_t count(HostSwitch::Outcome outcome) const;
  // All that were not left out have switched.
  [[nodiscard]] bool is_whole() const;
};

// The question of that verb to all hosts: wire::LinkCall::ask_hosts(). May throw wire::CallError;
// a wire::NotAskedError says that no host has been asked.
using AskHosts =
    std::function<std::vector<wire::HostAnswer>(const std::string& verb, const std::string& text)>;

// What the link of this host knows of the others, some time after the last look. May throw
// std::runtime_error: it is asked again.
using LookAtHosts = std::function<wire::HostsDocument()>;
// Until it is given up: a daemon may have been busy, and a cut may be short.
inline constexpr int kMostLooks = 12;

// Throws wire::CallError if hosts cannot be asked to prepare; then none has switched. A host that
// does not say what has come of its commit is looked at: if the model is in force there since, it
// has switched. If it is not, it may still come into force.
[[nodiscard]] SwitchEverywhere switch_everywhere(const wire::SwitchRequest& request,
                                                 const AskHosts& ask, const LookAtHosts& look);

// 0: all hosts have switched; 1: none has; 3: some have not, or that is not known.
[[nodiscard]] int exit_code_of(const SwitchEverywhere& result);
// cli/switch_report.cpp
void write_text(const SwitchEverywhere& result, const std::string& model);
void write_json(const SwitchEverywhere& result, const std::string& model);

}  // namespace arbiter::cli
