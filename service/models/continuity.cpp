#include "service/models/continuity.hpp"

#include <algorithm>
#include <utility>

namespace arbiter::service {
namespace {

using rules::CompiledModel;
using rules::CompiledPort;
using rules::CompiledRule;

bool is_same_port(const CompiledPort& a, const CompiledPort& b) {
  return a.arbitrated == b.arbitrated && a.in_order == b.in_order && a.reads == b.reads &&
         a.rules == b.rules;
}

bool are_timeouts_same(const CompiledPort& port, const CompiledModel& a, const CompiledModel& b) {
  const auto is_same = [&](const std::string& source) {
    return a.timeout_of(source) == b.timeout_of(source);
  };
  return std::all_of(port.reads.begin(), port.reads.end(), is_same) &&
         std::all_of(port.rules.begin(), port.rules.end(),
                     [&](const CompiledRule& rule) { return is_same(rule.source); });
}

}  // namespace

void Continuity::change(const CompiledModel* before, const CompiledModel& after,
                        shm::Nanoseconds before_since) {
  std::map<std::string, shm::Nanoseconds> kept;
  if (before != nullptr && before_since != 0) {
    auto old = before->ports.begin();  // both are in byte order
    for (const CompiledPort& port : after.ports) {
      while (old != before->ports.end() && old->port < port.port) ++old;
      if (old == before->ports.end()) break;
      if (old->port != port.port || !is_same_port(*old, port) ||
          !are_timeouts_same(port, *before, after)) {
        continue;
      }
      const auto earlier = ports_.find(port.port);
      kept[port.port] = earlier == ports_.end() ? before_since : earlier->second;
    }
  }
  ports_ = std::move(kept);
}

void Continuity::change_timeouts(const PortNames& names, const shm::TableView& before,
                                 const shm::TableView& after, shm::Nanoseconds now) {
  for (const auto& source : names.sources()) {
    const shm::Nanoseconds timeout = before.timeout(source->id);
    if (timeout == after.timeout(source->id)) continue;
    // Relaxed is enough: it is only compared with what the same word says later.
    const shm::ActivityWord word = source->has_page()
                                       ? source->activity().word.load(std::memory_order_relaxed)
                                       : shm::kNeverActive;
    const auto earlier = timeouts_.find(source->name);
    if (earlier == timeouts_.end() || earlier->second.word != word) {
      timeouts_[source->name] = {timeout, now, word};
    } else if (earlier->second.timeout == after.timeout(source->id)) {
      timeouts_.erase(earlier);  // as if it had always been so
    }
  }
}

}  // namespace arbiter::service
