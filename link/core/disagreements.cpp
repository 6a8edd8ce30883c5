#include "link/core/disagreements.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string_view>

namespace arbiter::link {
namespace {

// Strangers may be many, and each change of them is a line of the log.
constexpr std::size_t kMostListed = 8;

std::string listed(const std::vector<std::string>& hosts) {
  const std::size_t count = std::min(hosts.size(), kMostListed);
  std::string text;
  for (std::size_t i = 0; i < count; ++i) {
    if (i != 0) text += i + 1 == hosts.size() ? " and " : ", ";
    text += hosts[i];
  }
  if (count < hosts.size()) text += " and " + std::to_string(hosts.size() - count) + " more";
  return text;
}

// Of each name the machine that came last, unless others have been beside it for long.
std::vector<PresentHost> without_earlier_lives(const std::vector<PresentHost>& hosts,
                                               shm::Nanoseconds now) {
  std::vector<PresentHost> result;
  for (const PresentHost& each : hosts) {
    const bool has_later_life =
        std::any_of(hosts.begin(), hosts.end(), [&](const PresentHost& other) {
          return other.card->host == each.card->host && other.since > each.since &&
                 now - other.since < Disagreements::kNoEarlierLife;
        });
    if (!has_later_life) result.push_back(each);
  }
  return result;
}

using HostsOfName = std::map<std::string_view, std::vector<std::string>>;

void add_shared(DisagreementKind kind, const HostsOfName& by_name,
                std::set<Disagreement>& disagreements) {
  for (const auto& [name, hosts] : by_name) {
    if (hosts.size() < 2) continue;
    Disagreement one{kind, std::string(name), hosts};
    std::sort(one.hosts.begin(), one.hosts.end());
    disagreements.insert(std::move(one));
  }
}

std::set<Disagreement> compare(const std::vector<PresentHost>& hosts) {
  HostsOfName inputs;
  HostsOfName outputs;
  HostsOfName names;
  std::set<std::uint64_t> digests;
  Disagreement models{DisagreementKind::kModel, {}, {}};
  for (const PresentHost& host : hosts) {
    const HostCard& card = *host.card;
    names[card.host].push_back(card.host);
    for (const std::string& port : card.inputs) inputs[port].push_back(card.host);
    for (const std::string& port : card.outputs) outputs[port].push_back(card.host);
    if (card.digest == 0) continue;
    digests.insert(card.digest);
    models.hosts.push_back(card.host);
  }
  std::set<Disagreement> disagreements;
  add_shared(DisagreementKind::kInputPort, inputs, disagreements);
  add_shared(DisagreementKind::kSource, outputs, disagreements);
  add_shared(DisagreementKind::kHostName, names, disagreements);
  std::sort(models.hosts.begin(), models.hosts.end());
  if (digests.size() > 1) disagreements.insert(std::move(models));
  return disagreements;
}

}  // namespace

std::string Disagreement::text() const {
  switch (kind) {
    case DisagreementKind::kInputPort:
      return "the input port " + name + " is open on the hosts " + listed(hosts) +
             ", and each decides it for itself: close it on all but one";
    case DisagreementKind::kSource:
      return "the source " + name + " is open on the hosts " + listed(hosts) +
             ": each of them obeys its own";
    case DisagreementKind::kHostName:
      return "several machines are called " + name + ": give each its own --host";
    case DisagreementKind::kModel:
      break;
  }
  return "the models of the hosts " + listed(hosts) + " are not all the same";
}

std::vector<Disagreement> Disagreements::look(const std::vector<PresentHost>& hosts,
                                              shm::Nanoseconds now) {
  const std::set<Disagreement> there = compare(without_earlier_lives(hosts, now));
  std::erase_if(found_, [&](const auto& each) { return !there.contains(each.first); });
  for (const Disagreement& each : there) found_.try_emplace(each, Standing{now, false});
  std::vector<Disagreement> news;
  std::size_t reported = standing().size();
  for (auto& [disagreement, standing] : found_) {
    if (standing.is_reported || now - standing.since < kSettles || reported >= kMost) continue;
    standing.is_reported = true;
    ++reported;
    news.push_back(disagreement);
  }
  return news;
}

std::vector<Disagreement> Disagreements::standing() const {
  std::vector<Disagreement> result;
  for (const auto& [disagreement, standing] : found_) {
    if (standing.is_reported) result.push_back(disagreement);
  }
  return result;
}

}  // namespace arbiter::link
