// Doctor: ports that cannot do their work, as the status tells.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "rules/text/names.hpp"
#include "shm/clock.hpp"
#include "shm/utf8.hpp"
#include "watch/doctor.hpp"
#include "watch/past.hpp"
#include "watch/process.hpp"
#include "watch/span.hpp"

namespace arbiter::watch {
namespace {

// A model may have thousands of connections, and one mistake can spoil them all.
constexpr std::size_t kMostOfCode = 8;

// Adds what it is given of one code; of more than that, how many they are.
class FewFindings {
 public:
  FewFindings(Findings& found, std::string code, std::string others)
      : found_(found), code_(std::move(code)), others_(std::move(others)) {}
  FewFindings(const FewFindings&) = delete;
  FewFindings& operator=(const FewFindings&) = delete;
  ~FewFindings() {
    if (count_ <= kMostOfCode) return;
    found_.push_back({code_, std::to_string(count_ - kMostOfCode) + " more " + others_, "as above",
                      "arbiter status shows all"});
  }

  void add(std::string what, std::string why, std::string mend) {
    if (++count_ > kMostOfCode) return;
    found_.push_back({code_, std::move(what), std::move(why), std::move(mend)});
  }

 private:
  Findings& found_;
  const std::string code_, others_;
  std::size_t count_ = 0;
};

void add_mismatches(const wire::Status& status, Findings& found) {
  FewFindings few(found, "type-mismatch", "connections are refused, for what their ports are");
  for (const wire::InputStatus& port : status.inputs) {
    for (const wire::ConnectionStatus& each : port.connections) {
      if (!each.mismatch) continue;
      few.add("the connection of " + each.source + " to " + port.name +
                  " is refused: " + *each.mismatch,
              "nothing that is published at " + each.source + " is taken at " + port.name,
              "mend that in one of the two components, or take the connection out of the model");
    }
  }
}

bool has_mismatch(const wire::InputStatus& port, const std::string& source) {
  return std::any_of(port.connections.begin(), port.connections.end(),
                     [&](const auto& each) { return each.source == source && each.mismatch; });
}

void add_useless_winners(const wire::Status& status, Findings& found) {
  FewFindings few(found, "cannot-deliver", "ports have a selected source that cannot deliver");
  for (const wire::InputStatus& port : status.inputs) {
    if (!port.cannot_deliver) continue;
    const auto& [source, why] = *port.cannot_deliver;
    if (has_mismatch(port, source)) continue;  // that is told
    std::string what = source;
    what.append(" is selected at ").append(port.name).append(" and cannot deliver: ").append(why);
    few.add(std::move(what), port.name + " is idle, though the model has somebody command it",
            "arbiter why " + port.name + " " + source + " says what stands in its way");
  }
}

struct RefusedPorts {
  const wire::RefusalStatus* last;
  std::vector<std::string> ports;
};

// By process, the latest first: what keeps it from one port keeps it from others.
std::vector<RefusedPorts> refused_ports(const wire::Status& status) {
  std::vector<RefusedPorts> result;
  std::map<std::pair<std::int32_t, std::string>, std::size_t> places;
  for (const wire::RefusalStatus& each : status.refusals) {
    const bool is_left = each.output ? is_vacant(status.find_source(*each.output))
                                     : each.input && is_vacant(status.find_input(*each.input));
    if (!is_left || has_died_since(status, each.output ? kOutputEnd : kInputEnd, each)) continue;
    const auto [found, is_new] = places.try_emplace({each.pid, each.node}, result.size());
    if (is_new) result.push_back({&each, {}});
    result[found->second].ports.push_back(each.output ? *each.output : *each.input);
  }
  return result;
}

void add_refused(const wire::Status& status, Findings& found) {
  FewFindings few(found, "opening-refused", "components were refused ports");
  for (const auto& [last, ports] : refused_ports(status)) {
    few.add(process_text(*last) + " asked for " + rules::enumerate(ports) + " and was refused " +
                span_text(shm::monotonic_now() - last->at) + " ago: " + last->why,
            "the model mentions " + std::string(ports.size() == 1 ? "that port" : "these ports") +
                ", and nobody has " + (ports.size() == 1 ? "it" : "them") + " open",
            "remove the cause (for example, allow it in the policy), then start the component "
            "again");
  }
}

void add_troubles(const auto& ports, const char* how, FewFindings& few) {
  for (const auto& port : ports) {
    if (!port.open || !port.open->described || !port.open->trouble.value_or(false)) continue;
    few.add(port.name + how + shm::printable(*port.open->described),
            process_text(port.open->component) + ", which has the port open, says so",
            "its words say what is wrong; its page and its log say more");
  }
}

// What components call wrong with what stands behind their ports.
void add_troubles(const wire::Status& status, Findings& found) {
  FewFindings few(found, "port-trouble", "ports have trouble behind them");
  add_troubles(status.sources, " comes from ", few);
  add_troubles(status.inputs, " goes to ", few);
}

// Ports that the model does not mention, while nobody has one open that is nearly called so.
void add_near_names(const auto& ports, FewFindings& few) {
  std::vector<std::string_view> wanted;
  for (const auto& port : ports) {
    if (is_vacant(&port)) wanted.push_back(port.name);
  }
  if (wanted.empty()) return;
  std::size_t compared = 0;
  for (const auto& port : ports) {
    if (!port.open || port.mentioned) continue;
    if (compared++ == rules::kMaxSuggestions) return;
    const auto meant = rules::find_similar(port.name, wanted);
    if (!meant) continue;
    few.add(process_text(port.open->component) + " has " + port.name +
                " open, which the model does not mention; did you mean " + *meant +
                ", which nobody has open?",
            "the model connects nothing to a port that it does not mention",
            "correct the name, in the component or in the model");
  }
}

void add_near_names(const wire::Status& status, Findings& found) {
  FewFindings few(found, "near-name", "open ports have nearly the name of one of the model's");
  add_near_names(status.sources, few);
  add_near_names(status.inputs, few);
}

}  // namespace

Findings examine_ports(const wire::Status& status) {
  Findings found;
  add_mismatches(status, found);
  add_useless_winners(status, found);
  add_refused(status, found);
  add_troubles(status, found);
  add_near_names(status, found);
  return found;
}

}  // namespace arbiter::watch
