#include "recorder/open_ports.hpp"

#include <algorithm>

#include "watch/imported.hpp"

namespace arbiter::recorder {

using evidence::PortChange;

// With those whose component has not come back to this daemon yet: they are as they were.
OpenPorts::Ports OpenPorts::ports_of(const wire::Status& status) const {
  Ports ports;
  const auto note = [&](bool is_input, const std::string& name, const auto& open) {
    PortChange& port = ports[{is_input, name}];
    port.is_input = is_input;
    port.port = name;
    port.node = open.component.node;
    port.pid = open.component.pid;
    if (open.type) port.type = open.type->name;
  };
  const auto note_away = [&](bool is_input, const auto& away) {
    const auto known = ports_.find({is_input, away.name});
    if (known != ports_.end() && known->second.pid == away.away_pid) ports.insert(*known);
  };
  for (const auto& source : status.sources) {
    if (!source.open) {
      note_away(false, source);
      continue;
    }
    note(false, source.name, *source.open);
    const std::string host = watch::host_of(source);
    if (host != watch::kUnknownHost) ports[{false, source.name}].host = host;
  }
  for (const auto& input : status.inputs) {
    input.open ? note(true, input.name, *input.open) : note_away(true, input);
  }
  return ports;
}

void OpenPorts::note(const wire::Status& status, Nanoseconds now, Batch& batch) {
  Ports ports = ports_of(status);
  const auto tell = [&](PortChange change, PortChange::What what) {
    change.what = what;
    change.seen = now;
    batch.add(std::move(change));
  };
  const auto is_same = [](const PortChange& one, const PortChange& other) {
    return one.pid == other.pid && one.node == other.node && one.type == other.type;
  };
  note_deaths(status.deaths, batch);
  for (const auto& [key, before] : ports_) {
    const auto after = ports.find(key);
    if (after != ports.end() && is_same(after->second, before)) continue;
    tell(before, PortChange::What::closed);
  }
  for (const auto& [key, after] : ports) {
    const auto before = ports_.find(key);
    // A link says a little later from which host it imports, and may go over to another one.
    const bool is_known = before != ports_.end() && is_same(before->second, after) &&
                          before->second.host == after.host;
    if (is_known) continue;
    tell(after, is_known_ ? PortChange::What::opened : PortChange::What::open);
  }
  is_known_ = true;
  ports_ = std::move(ports);
}

// Also of ports that were opened since the last look.
void OpenPorts::note_deaths(const std::vector<wire::DeathStatus>& deaths, Batch& batch) {
  const Nanoseconds before = last_death_;
  for (const wire::DeathStatus& death : deaths) {
    if (death.at <= before) continue;
    last_death_ = std::max(last_death_, death.at);
    for (const bool is_input : {false, true}) {
      for (const std::string& name : is_input ? death.inputs : death.outputs) {
        PortChange change;
        const auto known = ports_.find({is_input, name});
        if (known != ports_.end() && known->second.pid == death.pid) {
          change = known->second;
          ports_.erase(known);  // and is not closed besides
        }
        change.what = PortChange::What::died;
        change.is_input = is_input;
        change.port = name;
        change.node = death.node;
        change.pid = death.pid;
        change.seen = death.at;
        batch.add(std::move(change));
      }
    }
  }
}

}  // namespace arbiter::recorder
