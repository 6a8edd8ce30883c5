#include "link/core/disagreements.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <string_view>
#include <utility>

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

using Subject = std::pair<DisagreementKind, std::string>;
using Found = std::map<Subject, std::vector<std::string>>;  // hosts in byte order

void add_shared(DisagreementKind kind, const HostsOfName& by_name, Found& found) {
  for (const auto& [name, hosts] : by_name) {
    if (hosts.size() >= 2) found[{kind, std::string(name)}] = hosts;
  }
}

Found compare(const std::vector<PresentHost>& hosts) {
  HostsOfName inputs;
  HostsOfName outputs;
  HostsOfName names;
  std::set<std::uint64_t> digests;
  std::vector<std::string> with_models;
  for (const PresentHost& host : hosts) {
    const HostCard& card = *host.card;
    names[card.host].push_back(card.host);
    for (const std::string& port : card.inputs) inputs[port].push_back(card.host);
    for (const std::string& port : card.outputs) outputs[port].push_back(card.host);
    if (card.digest == 0) continue;
    digests.insert(card.digest);
    with_models.push_back(card.host);
  }
  Found found;
  add_shared(DisagreementKind::kInputPort, inputs, found);
  add_shared(DisagreementKind::kSource, outputs, found);
  add_shared(DisagreementKind::kHostName, names, found);
  if (digests.size() > 1) found[{DisagreementKind::kModel, {}}] = std::move(with_models);
  for (auto& each : found) std::sort(each.second.begin(), each.second.end());
  return found;
}

bool have_two_in_common(const std::vector<std::string>& some,
                        const std::vector<std::string>& others) {
  std::vector<std::string> both;
  std::set_intersection(some.begin(), some.end(), others.begin(), others.end(),
                        std::back_inserter(both));
  return both.size() >= 2;
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
  Found there = compare(without_earlier_lives(hosts, now));
  std::erase_if(found_, [&](const auto& each) { return !there.contains(each.first); });
  for (auto& [subject, its] : there) update(subject, std::move(its), now);
  std::vector<Disagreement> news;
  std::size_t standing = 0;
  for (const auto& each : found_) standing += each.second.stands ? 1 : 0;
  for (auto& [subject, each] : found_) {
    if (!each.stands && now - each.since < kSettles) continue;
    if (!each.stands && standing >= kMost) {
      if (!make_place_for(subject.first)) continue;
      --standing;
    }
    const bool is_new = !std::exchange(each.stands, true);
    standing += is_new ? 1 : 0;
    // Other hosts are news once they are the same for a while.
    if (!is_new && (each.is_reported || now - each.of_these < kSettles)) continue;
    each.is_reported = true;
    news.push_back({subject.first, subject.second, each.hosts});
  }
  return news;
}

bool Disagreements::make_place_for(DisagreementKind kind) {
  const auto warning = std::find_if(found_.rbegin(), found_.rend(), [](const auto& each) {
    return each.second.stands && !is_error(each.first.first);
  });
  if (!is_error(kind) || warning == found_.rend()) return false;
  warning->second.stands = false;
  return true;
}

void Disagreements::take_back(const Disagreement& news) {
  const auto found = found_.find({news.kind, news.name});
  if (found != found_.end()) found->second.is_reported = false;
}

void Disagreements::update(Subject subject, std::vector<std::string> hosts, shm::Nanoseconds now) {
  Standing& known = found_[std::move(subject)];
  if (known.hosts == hosts) return;
  if (!have_two_in_common(known.hosts, hosts)) known = {{}, now, now, false, false};
  known.hosts = std::move(hosts);
  known.of_these = now;
  known.is_reported = false;
}

std::vector<Disagreement> Disagreements::standing() const {
  std::vector<Disagreement> result;
  for (const auto& [subject, each] : found_) {
    if (each.stands) result.push_back({subject.first, subject.second, each.hosts});
  }
  return result;
}

}  // namespace arbiter::link
