// What is wrong among hosts, as the link of this one knows it.
#include <chrono>
#include <stdexcept>

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
