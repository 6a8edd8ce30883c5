#include "tests/stress/accounts.hpp"

#include <algorithm>
#include <utility>

namespace arbiter::stress {
namespace {

using nlohmann::json;

std::uint64_t read(const shm::Atomic<std::uint64_t>& counter) {
  return counter.load(std::memory_order_acquire);
}

void require(std::vector<std::string>& errors, const std::string& what, std::uint64_t left,
             std::uint64_t right) {
  if (left != right) {
    errors.push_back(what + ": " + std::to_string(left) + " are not " + std::to_string(right));
  }
}

}  // namespace

void Accounts::watch(std::uint32_t component, pid_t process) {
  test::OwnSegments own = test::map_segments_of(process);
  for (auto& output : own.outputs) outputs_.push_back({component, std::move(output)});
  for (auto& input : own.inputs) inputs_.push_back({component, std::move(input)});
}

const Accounts::Output* Accounts::living_output(std::uint32_t component) const {
  const auto last = std::find_if(outputs_.rbegin(), outputs_.rend(), [&](const Output& output) {
    return output.component == component;
  });
  return last == outputs_.rend() ? nullptr : &*last;
}

std::vector<std::string> Accounts::errors_in_segments(const PortIds& ids) const {
  std::vector<std::string> errors;
  for (std::uint32_t component = 0; component < plan_.components.size(); ++component) {
    const ComponentState& state = records_.components[component];
    const ComponentPlan& what = plan_.components[component];
    if (what.source != kNobody) {
      const Output* output = living_output(component);
      if (output == nullptr) {
        errors.push_back(source_name(what.source) + " has no segment");
        continue;
      }
      const shm::OutputCounters& counters = output->own.segment.header().counters;
      const std::string name = source_name(what.source) + "'s ";
      require(errors, name + "published", read(counters.published), state.published.load());
      require(errors, name + "signals", read(counters.signals), state.signals.load());
      require(errors, name + "delivered", read(counters.delivered), state.delivered.load());
      require(errors, name + "discarded", read(counters.discarded), state.discarded.load());
      require(errors, name + "refused", read(counters.refused), state.refused.load());
      require(errors, name + "no_slot", read(counters.no_slot), 0);
    }
    if (what.port == kNobody) continue;
    const auto all = std::count_if(inputs_.begin(), inputs_.end(), [&](const Input& input) {
      return input.component == component;
    });
    const auto input = std::find_if(inputs_.begin(), inputs_.end(),
                                    [&](const Input& each) { return each.component == component; });
    const auto id = ids.find(port_name(what.port));
    if (all != 1 || id == ids.end()) continue;
    std::uint64_t sum = 0;
    for (const Output& output : outputs_) {
      sum += test::accepted_for(output.own.segment, id->second);
    }
    const shm::InputCounters& counters = input->own.segment->header.counters;
    const std::string name = port_name(what.port) + "'s ";
    require(errors, name + "taken", read(counters.taken), state.taken.load());
    require(errors, name + "misbehaved", read(counters.misbehaved), 0);
    require(errors,
            name + "taken " + std::to_string(read(counters.taken)) + " + dropped " +
                std::to_string(read(counters.dropped)) + " + overtaken " +
                std::to_string(read(counters.overtaken)) + " against what was accepted for it",
            read(counters.taken) + read(counters.dropped) + read(counters.overtaken), sum);
  }
  return errors;
}

std::vector<std::string> Accounts::errors_in_status(const json& status, bool all_open) const {
  std::vector<std::string> errors;
  std::map<std::string, std::uint64_t> published;
  std::map<std::string, std::uint64_t> accepted_of;
  for (const auto& source : status.at("sources")) {
    if (source.at("open").get<bool>()) {
      published[source.at("name")] = source.at("published").get<std::uint64_t>();
      require(errors, source.at("name").get<std::string>() + "'s no_slot",
              source.at("no_slot").get<std::uint64_t>(), 0);
    }
  }
  for (const auto& input : status.at("inputs")) {
    const std::string port = input.at("name");
    std::uint64_t taken = 0;
    for (const auto& connection : input.at("connections")) {
      const std::string source = connection.at("source");
      const auto count = [&](const char* key) { return connection.at(key).get<std::uint64_t>(); };
      require(errors, source + " at " + port + ", accepted against what became of it",
              count("accepted"),
              count("taken") + count("dropped") + count("overtaken") + count("waiting"));
      taken += count("taken");
      accepted_of[source] += count("accepted");
      if (!all_open) continue;
      require(errors, source + " at " + port + ", published against accepted, discarded, refused",
              published[source], count("accepted") + count("discarded") + count("refused"));
    }
    if (all_open && input.at("open").get<bool>()) {
      require(errors, port + "'s taken", input.at("taken").get<std::uint64_t>(), taken);
    }
  }
  if (!all_open) return errors;
  for (const ComponentPlan& what : plan_.components) {
    if (what.source == kNobody) continue;
    const auto index = static_cast<std::size_t>(&what - plan_.components.data());
    require(errors, source_name(what.source) + "'s accepted at all ports",
            accepted_of[source_name(what.source)], records_.components[index].delivered.load());
  }
  return errors;
}

std::uint64_t Accounts::undecided() const {
  std::uint64_t sum = 0;
  for (const Output& output : outputs_) {
    const shm::OutputCounters& counters = output.own.segment.header().counters;
    sum += read(counters.blind) + read(counters.unsettled);
  }
  return sum;
}

}  // namespace arbiter::stress
