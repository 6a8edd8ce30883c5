// What is wrong among hosts, as the link of this one knows it.
#include <chrono>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "rules/text/names.hpp"
#include "watch/doctor.hpp"
#include "wire/link_call.hpp"

namespace arbiter::watch {
namespace {

constexpr std::chrono::milliseconds kLinkPatience{1000};

void add_disagreement(const wire::HostDisagreement& each, Findings& found) {
  switch (each.kind) {
    case wire::DisagreementKind::kInputPort:
      found.push_back({"port-on-two-hosts", each.text,
                       "each host decides for its own, so two components may obey different "
                       "commands",
                       "end the component on all hosts but one"});
      return;
    case wire::DisagreementKind::kSource:
      found.push_back({"source-on-two-hosts", each.text,
                       "other hosts take it from one of them, and keep that one until it is gone",
                       "end the component on all hosts but one, or give its port another name"});
      return;
    case wire::DisagreementKind::kHostName:
      found.push_back({"shared-host-name", each.text,
                       "a source of one of them may be taken for that of the other",
                       "start each machine's link with a --host of its own"});
      return;
    case wire::DisagreementKind::kModel:
      return;  // hosts may well have models of their own
  }
}

// Of hosts that are gone, those from which something came that the model here wants.
void add_gone(const wire::HostsDocument& hosts, Findings& found) {
  std::map<std::string, std::vector<std::string>> sources;
  for (const wire::ImportStatus& each : hosts.imports) {
    const wire::HostStatus* const host = hosts.find_host(each.host);
    const bool is_up = host != nullptr && host->is_up;
    if (each.is_gone() && !is_up) sources[each.host].push_back(each.source);
  }
  for (const auto& [host, of_it] : sources) {
    found.push_back({"host-gone",
                     "host " + host + " is gone, from which came " + rules::enumerate(of_it),
                     "these sources are silent here until it is heard again",
                     "look at its cable, and there at arbiter-link and arbiterd (arbiter doctor)"});
  }
}

// They look as if they were well.
void add_deaf(const wire::HostsDocument& hosts, Findings& found) {
  for (const wire::HostStatus& each : hosts.hosts) {
    if (!each.is_deaf) continue;
    found.push_back({"deaf-host",
                     "host " + each.host + " is there, and has not heard this one for 2 s",
                     "nothing is imported from it until it does, and it gets nothing from here",
                     "see whether the network, and the firewall there, let words through both "
                     "ways"});
  }
}

}  // namespace

Findings examine_hosts(const wire::HostsDocument& hosts) {
  Findings found;
  if (hosts.waits_for) {
    found.push_back({"link-waits", "the link of this host cannot do its work: " + *hosts.waits_for,
                     "what other hosts have does not come here, or what this one has does not "
                     "leave it",
                     "mend what it says; it tries again by itself"});
  }
  for (const wire::HostDisagreement& each : hosts.disagreements) add_disagreement(each, found);
  add_gone(hosts, found);
  add_deaf(hosts, found);
  return found;
}

Findings examine_link(const std::string& instance) {
  try {
    return examine_hosts(
        wire::read_hosts(wire::LinkCall(instance, kLinkPatience).ask({"", "hosts"})));
  } catch (const wire::NoLinkError&) {
    return {};  // this host is alone
  } catch (const std::runtime_error& error) {
    return {{"silent-link", std::string("the link of this host does not answer: ") + error.what(),
             "what other hosts do, this one may not hear, and nobody can ask",
             "journalctl -u arbiter-link, and start it again if it hangs"}};
  }
}

}  // namespace arbiter::watch
