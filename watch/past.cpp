#include "watch/past.hpp"

#include <algorithm>

#include "watch/process.hpp"
#include "watch/span.hpp"

namespace arbiter::watch {
namespace {

bool has_name(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

const wire::DeathStatus* death_of(const wire::Status& status, const PortEnd& end,
                                  const std::string& port) {
  const auto found =
      std::find_if(status.deaths.begin(), status.deaths.end(),
                   [&](const auto& each) { return has_name(each.*end.left_open, port); });
  const bool is_last = found != status.deaths.end() && !has_name(found->opened_since, port);
  return is_last ? &*found : nullptr;
}

std::string death_text(const wire::DeathStatus& death, std::optional<shm::Nanoseconds> now) {
  return process_text(death) + " had it open, and died" +
         (now ? ' ' + span_text(*now - death.at) + " ago" : "");
}

bool has_died_since(const wire::Status& status, const PortEnd& end,
                    const wire::RefusalStatus& refusal) {
  const wire::DeathStatus* const death = death_of(status, end, (refusal.*end.refused).value_or(""));
  return death != nullptr && refusal.at < death->at;
}

const wire::RefusalStatus* refusal_of(const wire::Status& status, const PortEnd& end,
                                      const std::string& port) {
  const auto found = std::find_if(status.refusals.begin(), status.refusals.end(),
                                  [&](const auto& each) { return each.*end.refused == port; });
  const bool stands = found != status.refusals.end() && !has_died_since(status, end, *found);
  return stands ? &*found : nullptr;
}

}  // namespace arbiter::watch
