#include <algorithm>

#include <nlohmann/json.hpp>

#include "rules/ask/model_diff.hpp"
#include "rules/prove/winners.hpp"
#include "rules/text/duration.hpp"
#include "rules/text/names.hpp"

namespace arbiter::rules {
namespace {

using PortDiff = ModelDiff::PortDiff;

constexpr std::size_t kMaxChangesShown = 8;  // of a port, in the text; JSON has them all

std::string winner_name(const std::optional<std::string>& winner) {
  return winner.value_or("nobody");
}

std::string states_text(const std::string& states) {
  return states + (states == "1" ? " state" : " states");
}

void write_change(std::ostream& out, const ModelDiff::Change& change) {
  out << "  " << winner_name(change.before) << " -> " << winner_name(change.after) << ": ";
  if (!change.states.empty()) out << states_text(change.states) << (change.example ? ", " : "");
  if (change.example) out << "such as with " << in_words(*change.example);
  out << '\n';
}

void write_states(std::ostream& out, const PortDiff& port) {
  if (!port.open.empty()) {
    out << "  not known: comparing the winners takes " << port.open << '\n';
    return;
  }
  if (port.changes.empty()) return;
  if (port.is_counted) {
    out << "  decides differently in " << port.states << " of 2^" << port.sources << " = "
        << port.of << " states\n";
  } else {
    out << "  decides differently in some of 2^" << port.sources
        << " states, which are too entangled to be counted\n";
  }
  for (std::size_t i = 0; i < std::min(port.changes.size(), kMaxChangesShown); ++i) {
    write_change(out, port.changes[i]);
  }
  if (port.changes.size() > kMaxChangesShown) {
    out << "  and " << port.changes.size() - kMaxChangesShown
        << " more pairs of winners; --json has them all\n";
  }
  if (!port.is_complete)
    out << "  other pairs of winners may differ, too: not all were looked at\n";
}

void write_port(std::ostream& out, const PortDiff& port) {
  out << port.port << '\n';
  const auto tell_kind = [&](const char* when, bool arbitrated) {
    out << "  exists only " << when << (arbitrated ? ", arbitrated" : ", not arbitrated") << '\n';
  };
  if (!port.exists_before) tell_kind("after", port.arbitrated_after);
  if (!port.exists_after) tell_kind("before", port.arbitrated_before);
  if (port.exists_before && port.exists_after && port.arbitrated_before != port.arbitrated_after) {
    out << "  is arbitrated only " << (port.arbitrated_before ? "before" : "after")
        << ": without rules everything is delivered\n";
  }
  const auto tell_only = [&](const char* what, const std::vector<std::string>& sources) {
    if (!sources.empty()) out << "  " << what << ": " << comma_list(sources) << '\n';
  };
  tell_only("connected only before", port.connections_before);
  tell_only("connected only after", port.connections_after);
  tell_only("read only before", port.reads_before);
  tell_only("read only after", port.reads_after);
  if (port.first_wins_before != port.first_wins_after) {
    out << "  conflict=\"first\" only " << (port.first_wins_before ? "before" : "after") << '\n';
  }
  write_states(out, port);
}

}  // namespace

void write_text(std::ostream& out, const ModelDiff& diff) {
  for (const auto& timeout : diff.timeouts) {
    out << (timeout.source.empty() ? "timeout of all others" : "timeout of " + timeout.source)
        << ": " << to_string(timeout.before) << " -> " << to_string(timeout.after) << '\n';
  }
  for (const auto& port : diff.ports) write_port(out, port);
  out << summary(diff) << '\n';
}

std::string summary(const ModelDiff& diff) {
  constexpr std::size_t kMaxNames = 4;
  const auto list = [&](const auto& is_one) {
    std::vector<std::string> names;
    for (const auto& port : diff.ports) {
      if (is_one(port)) names.push_back(port.port);
    }
    return names;
  };
  const auto named = [&](std::vector<std::string> names) {
    const std::size_t count = names.size();
    if (count > kMaxNames) names.resize(kMaxNames);
    return " (" + comma_list(names) + (count > kMaxNames ? ", …)" : ")");
  };
  const auto changed = list([](const PortDiff& port) { return port.differs(); });
  const auto open = list([](const PortDiff& port) { return !port.open.empty(); });
  std::string text;
  const auto decides_alike = [](const PortDiff& port) {
    return port.differs() && port.changes.empty();
  };
  if (!changed.empty()) {
    const bool is_one = changed.size() == 1;
    text = std::to_string(changed.size()) + " of " + counted(diff.compared_ports, "port");
    if (std::any_of(diff.ports.begin(), diff.ports.end(), decides_alike)) {
      text += is_one ? " differs" : " differ";
    } else {
      text += is_one ? " decides differently" : " decide differently";
    }
    text += named(changed);
  }
  if (!diff.timeouts.empty()) {
    text += (text.empty() ? "" : "; ") + counted(diff.timeouts.size(), "timeout") + " changed";
  }
  if (!open.empty()) {
    text += (text.empty() ? "" : "; ") + counted(open.size(), "port") +
            " not compared, for lack of steps" + named(open);
  }
  if (!text.empty()) return text;
  return "no difference: " + counted(diff.compared_ports, "port") +
         (diff.compared_ports == 1 ? " decides" : " decide") + " alike in every state";
}

void write_json(std::ostream& out, const ModelDiff& diff) {
  using Json = nlohmann::ordered_json;
  const auto or_null = [](const std::optional<std::string>& name) {
    return name ? Json(*name) : Json(nullptr);
  };
  Json ports = Json::array();
  for (const auto& port : diff.ports) {
    Json changes = Json::array();
    for (const auto& change : port.changes) {
      Json example = nullptr;
      if (change.example) {
        example = {{"active", change.example->active},
                   {"inactive", change.example->inactive},
                   {"shortest", change.example->is_shortest}};
      }
      changes.push_back({{"before", or_null(change.before)},
                         {"after", or_null(change.after)},
                         {"states", change.states.empty() ? Json(nullptr) : Json(change.states)},
                         {"example", std::move(example)}});
    }
    const auto side = [](bool exists, bool arbitrated, bool first_wins,
                         const std::vector<std::string>& connections,
                         const std::vector<std::string>& reads) {
      return Json{{"exists", exists},
                  {"arbitrated", arbitrated},
                  {"conflict", first_wins ? "first" : "error"},
                  {"only_here", connections},
                  {"read_only_here", reads}};
    };
    ports.push_back(
        {{"port", port.port},
         {"differs", port.differs()},
         {"before", side(port.exists_before, port.arbitrated_before, port.first_wins_before,
                         port.connections_before, port.reads_before)},
         {"after", side(port.exists_after, port.arbitrated_after, port.first_wins_after,
                        port.connections_after, port.reads_after)},
         {"sources", port.sources},
         {"states", port.open.empty() && port.is_counted ? Json(port.states) : Json(nullptr)},
         {"of", port.of},
         {"changes", std::move(changes)},
         {"all_changes", port.open.empty() && port.is_complete},
         {"open", port.open.empty() ? Json(nullptr) : Json(port.open)}});
  }
  Json timeouts = Json::array();
  for (const auto& timeout : diff.timeouts) {
    timeouts.push_back({{"source", timeout.source.empty() ? Json(nullptr) : Json(timeout.source)},
                        {"before", to_string(timeout.before)},
                        {"after", to_string(timeout.after)}});
  }
  const Json object = {{"differs", diff.differs()},       {"open", diff.is_open()},
                       {"summary", summary(diff)},        {"compared_ports", diff.compared_ports},
                       {"timeouts", std::move(timeouts)}, {"ports", std::move(ports)}};
  out << object.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
}

}  // namespace arbiter::rules
