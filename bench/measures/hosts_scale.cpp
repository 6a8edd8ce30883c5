// How the cost of links grows with sources and with hosts: rule 2 of docs/hosts.md (what is offered
// and imported: 100, 1000 and 4000 sources) and rule 8 (2, 10 and 50 hosts that know each other).
#include <poll.h>

#include <cstdio>
#include <deque>
#include <fstream>
#include <memory>
#include <numeric>

#include "bench/harness/hosts.hpp"
#include "bench/measures/measures.hpp"

namespace arbiter::bench {
namespace {

std::string source_of(int host, int number) {
  return "/Host" + std::to_string(host) + "/" + std::to_string(number) + ":o";
}

std::vector<std::string> sources_of(int host, int count) {
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) names.push_back(source_of(host, i));
  return names;
}

// A model that takes so many sources of that host, where components may have `own` open.
std::string model_for(int host, int sources, const std::vector<std::string>& own) {
  std::string behaviours = declared(own);
  for (int i = 0; i < sources; ++i) {
    behaviours += behaviour(source_of(host, i), "/In" + std::to_string(i) + ":i", 0);
  }
  return model(behaviours);
}

// A component that has that many output ports of host `host` open.
Worker publisher(const LinkedHost& on, int host, int sources) {
  Worker worker("publisher", [&on, host, sources](Conversation& with) {
    Node node = on.robot().node("publisher");
    std::vector<OutputPort<std::uint64_t>> ports;
    for (int i = 0; i < sources; ++i) {
      ports.push_back(node.output_port<std::uint64_t>(source_of(host, i)));
    }
    with.say(1);
    std::uint64_t word = 0;
    while (with.hear_or_end(word)) {
    }
  });
  static_cast<void>(worker.hear());
  return worker;
}

double resident_mib(pid_t pid) {
  std::ifstream stream("/proc/" + std::to_string(pid) + "/status");
  double kib = 0;
  for (std::string line; std::getline(stream, line);) {
    std::sscanf(line.c_str(), "VmRSS: %lf kB", &kib);
  }
  return kib / 1024;
}

// Of a processor, in percent, while nobody publishes: that of each host's link.
std::vector<double> shares_of_processor(const std::vector<const LinkedHost*>& hosts,
                                        double seconds) {
  std::vector<std::int64_t> before;
  for (const LinkedHost* const each : hosts) before.push_back(processor_time_ns(each->link()));
  const std::int64_t began = now_ns();
  ::poll(nullptr, 0, static_cast<int>(seconds * 1000));
  const auto took = static_cast<double>(now_ns() - began);
  std::vector<double> shares;
  for (std::size_t i = 0; i < hosts.size(); ++i) {
    const std::int64_t used = processor_time_ns(hosts[i]->link()) - before[i];
    shares.push_back(100.0 * static_cast<double>(used) / took);
  }
  return shares;
}

Case one_value(const std::string& name, const char* unit, const char* system, double value) {
  Case one{name};
  one.unit = unit;
  one.results.push_back({system, Role::kOurs, {}, value, {}});
  return one;
}

// One host has that many, and another imports as many of them as given.
void measure_sources(Measure& measure, int sources, int imports, double seconds) {
  NetworkSwitch network;
  LinkedHost head("head", model(declared(sources_of(0, sources))), network);
  LinkedHost base("base", model_for(0, imports, {}), network);
  head.start_link();
  ::poll(nullptr, 0, 1000);
  const double memory_before = resident_mib(head.link());
  const Worker component = publisher(head, 0, sources);
  // All are offered: the link asks once a second what is open, where much is.
  ::poll(nullptr, 0, 2000);
  base.start_link();
  const std::int64_t began = now_ns();
  base.await_imported(imports);
  const double found = static_cast<double>(now_ns() - began) / 1e6;
  const std::string of =
      std::to_string(sources) + " sources, " + std::to_string(imports) + " imported: ";
  ::poll(nullptr, 0, 1000);
  measure.cases.push_back(one_value(of + "until all are", "ms", "importing link", found));
  Case memory{of + "memory"};
  memory.unit = "MiB";
  memory.results = {
      {"exporting link", Role::kOurs, {}, resident_mib(head.link()), {}},
      {"of which its sources", Role::kOurs, {}, resident_mib(head.link()) - memory_before, {}},
      {"importing link", Role::kOurs, {}, resident_mib(base.link()), {}}};
  measure.cases.push_back(std::move(memory));
  const std::uint64_t before = head.space().bytes();
  const std::int64_t rested = now_ns();
  const std::vector<double> shares = shares_of_processor({&head, &base}, seconds);
  const double wire = static_cast<double>(head.space().bytes() - before) * 1e9 /
                      static_cast<double>(now_ns() - rested);
  Case rest{of + "share of a processor at rest"};
  rest.unit = "%";
  rest.results = {{"exporting link", Role::kOurs, {}, shares[0], {}},
                  {"importing link", Role::kOurs, {}, shares[1], {}}};
  measure.cases.push_back(std::move(rest));
  measure.cases.push_back(one_value(of + "on the wire at rest", "bytes/s", "exporting link", wire));
}

// Each host has ten sources, and takes all of the next one's.
void measure_hosts(Measure& measure, int count, double seconds) {
  constexpr int kSources = 10;
  NetworkSwitch network;
  std::deque<LinkedHost> hosts;
  std::vector<Worker> components;
  std::vector<const LinkedHost*> all;
  for (int i = 0; i < count; ++i) {
    hosts.emplace_back("host" + std::to_string(i),
                       model_for((i + 1) % count, kSources, sources_of(i, kSources)), network);
    all.push_back(&hosts.back());
  }
  for (int i = 0; i < count; ++i) {
    components.push_back(publisher(hosts[static_cast<std::size_t>(i)], i, kSources));
  }
  const std::int64_t began = now_ns();
  for (LinkedHost& each : hosts) each.start_link();
  for (const LinkedHost& each : hosts) each.await_imported(kSources);
  const std::string of = std::to_string(count) + " hosts: ";
  const auto add = [&](const char* what, const char* unit, double value) {
    Case one = one_value(of + what, unit, "each link", value);
    one.x = count;
    measure.cases.push_back(std::move(one));
  };
  add("until all have imported", "ms", static_cast<double>(now_ns() - began) / 1e6);
  ::poll(nullptr, 0, 2000);
  add("memory", "MiB", resident_mib(hosts.front().link()));
  const std::vector<double> shares = shares_of_processor(all, seconds);
  add("share of a processor at rest", "%",
      std::accumulate(shares.begin(), shares.end(), 0.0) / static_cast<double>(count));
  const std::uint64_t before = hosts.front().space().bytes();
  ::poll(nullptr, 0, static_cast<int>(seconds * 1000));
  add("on the wire at rest", "bytes/s",
      static_cast<double>(hosts.front().space().bytes() - before) / seconds);
}

}  // namespace

Measure measure_hosts_scale(const Effort& effort) {
  Measure measure{"hosts-scale", "Links, by sources and by hosts",
                  "A host with 100, 1000 and 4000 output ports (in a quick run 200), of which "
                  "another imports 100 (20); and "
                  "so many hosts on this machine, each in a network namespace of its own, with ten "
                  "sources that the next host imports. Until all are imported, counted from the "
                  "start of the links; then the links' memory, processor time and traffic while "
                  "nobody publishes. All hosts share this machine's processors."};
  measure.x_label = "hosts";
  const bool quick = effort.quick;
  const double seconds = quick ? 1 : 5;
  try {
    for (const int sources : quick ? std::vector<int>{200} : std::vector<int>{100, 1000, 4000}) {
      measure_sources(measure, sources, quick ? 20 : 100, quick ? 1 : 2);
    }
    for (const int hosts : quick ? std::vector<int>{2, 5} : std::vector<int>{2, 10, 50}) {
      measure_hosts(measure, hosts, seconds);
    }
  } catch (const std::exception& error) {
    measure.cases.push_back(
        {"links, by hosts", {}, {absent("each link", Role::kOurs, error.what())}});
  }
  return measure;
}

}  // namespace arbiter::bench
