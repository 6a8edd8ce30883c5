#include "gateway/dds/dds_middleware.hpp"

#include <algorithm>
#include <chrono>
#include <system_error>
#include <utility>

#include "gateway/core/say.hpp"
#include "gateway/mapping/partitions.hpp"
#include "rules/text/names.hpp"
#include "shm/clock.hpp"

namespace arbiter::gateway::dds {
namespace {

// Often enough for who sends idle samples for a second.
constexpr shm::Nanoseconds kOpenAgain = 200'000'000;
// The bell rings for whoever comes and goes. What is left is how things stand.
constexpr shm::Nanoseconds kStandingPeriod = 500'000'000;
// For Cyclone to join a domain. What takes longer, such as a name server that is silent, must not
// hold up the loop.
constexpr std::chrono::milliseconds kJoinsWithin{100};
constexpr shm::Nanoseconds kLongToJoin = 2'000'000'000;
// Cyclone needs some ten for each domain.
constexpr std::size_t kDescriptorsOfDomain = 32;

// On a thread of its own. Throws DdsError.
std::unique_ptr<Domain> join_domain(const Gateway& gateway, const std::set<std::string>& topics,
                                    const Bell& bell, PeerWatch& peer_names) {
  const CycloneWords words;
  try {
    Gateway known = gateway;
    known.peers = peer_names.accept(gateway.peers);
    // A configuration may ask for IPv6, of which no address is looked up.
    const bool may_be_ipv4 = gateway.configuration.empty();
    auto domain = std::make_unique<Domain>(may_be_ipv4 ? known : gateway, topics, bell);
    // Else it would be joined again each minute for an address that it cannot use.
    if (may_be_ipv4) peer_names.note_unknown(words.unknown_peers());
    words.tell();
    return domain;
  } catch (const DdsError&) {
    if (words.last().empty()) throw;
    throw DdsError("DDS cannot be joined: " + words.last());
  }
}

// Equal: what one has sent last may be sent by the other. No name has a line break.
std::string name_of_writer(const Gateway& gateway, const Entry& entry) {
  const DdsTopic& topic = *entry.dds;
  std::string name = std::to_string(domain_of(gateway)) + '\n' + topic.name + '\n' + topic.type +
                     '\n' + entry.port->name + '\n' +
                     (offered_representation(topic.qos) == Representation::kXcdr2 ? "2" : "1");
  for (const std::string& partition : topic.qos.partitions) name += '\n' + partition;
  return name;
}

}  // namespace

DdsMiddleware::DdsMiddleware(const std::vector<Mapping>& mappings, const Bell& bell,
                             LatchedSamples& latched)
    : bell_(bell), latched_(latched) {
  hear_cyclone();
  for (const Mapping& mapping : mappings) {
    for (const Gateway& gateway : mapping.gateways) {
      if (gateway.kind != Kind::kDds) continue;
      Site& site = sites_[domain_of(gateway)];
      if (site.gateway == nullptr) {
        site.gateway = &gateway;
        site.peer_names = std::make_unique<PeerWatch>(gateway.peers);
      } else if (!have_one_configuration(*site.gateway, gateway)) {
        throw DdsError("two gateways of DDS domain " + std::to_string(domain_of(gateway)) +
                       " name different interfaces, peers or configurations; a program has one "
                       "configuration for each domain: give both the same");
      }
      for (const Entry& entry : gateway.entries) {
        refuse_circle(site, entry);
        site.topics.insert(entry.dds->name);
        site.entries.push_back(&entry);
      }
    }
  }
  for (auto& [id, site] : sites_) order_.push_back(&site);
  std::stable_partition(order_.begin(), order_.end(),
                        [](const Site* site) { return !may_look_up_names(*site->gateway); });
  hold_low_descriptors();
}

void DdsMiddleware::hold_low_descriptors() noexcept {
  std::size_t closed = 0;
  for (const auto& [id, site] : sites_) closed += site.domain || site.joining.valid() ? 0 : 1;
  low_descriptors_.hold(closed * kDescriptorsOfDomain);
}

// The check of the mapping does not know which domain the environment says.
void DdsMiddleware::refuse_circle(const Site& site, const Entry& entry) {
  for (const Entry* const other : site.entries) {
    if (other->is_in() == entry.is_in() || other->dds->name != entry.dds->name ||
        !share_partition(other->dds->qos.partitions, entry.dds->qos.partitions)) {
      continue;
    }
    throw DdsError(rules::describe(entry.where) + ": " + entry.outside() +
                   " comes in and goes out within DDS domain " +
                   std::to_string(domain_of(*site.gateway)) + " (the other entry is at " +
                   rules::describe(other->where) +
                   "): publishers and subscribers must not meet past the gateway; remap one of "
                   "them to another topic, partition or domain");
  }
}

DdsMiddleware::~DdsMiddleware() {
  DdsMiddleware::stop();
  for (const auto& [name, out] : latching_) latched_.put(name, out->take_last());
}

DdsMiddleware::Site& DdsMiddleware::site_of(const Gateway& gateway) {
  return sites_.at(domain_of(gateway));
}

void DdsMiddleware::add(Site& site, EndPoint& end, Account& account) {
  site.ends.push_back(&end);
  site.accounts.push_back(&account);
  if (!site.problem.empty()) account.set_obstacle(site.problem);
}

Sender& DdsMiddleware::sender(const Gateway& gateway, const Entry& entry, Account& account) {
  OutTopic& out = outs_.emplace_back(entry, account, bell_);
  out_of_[&entry] = &out;
  add(site_of(gateway), out, account);
  if (out.latches()) {
    const std::string name = name_of_writer(gateway, entry);
    out.begin_with(latched_.take(name));
    latching_.emplace(name, &out);
  }
  return out;
}

void DdsMiddleware::start(const std::vector<OpenIn>& ins, const std::vector<OpenOut>& outs) {
  for (const OpenOut& out : outs) out_of_.at(&out.outgoing.entry())->tell(out.outgoing);
  std::vector<InTopic*> added;
  for (const OpenIn& in : ins) {
    added.push_back(&ins_.emplace_back(in.incoming, in.account, guard_, bell_));
    add(site_of(in.gateway), *added.back(), in.account);
  }
  if (!started_) {
    say_domains();
    latched_.clear();
    // One tick before there is a reader: see StallGuard.
    guard_.tick(shm::monotonic_now());
    stall_thread_.emplace(guard_, bell_);
  }
  started_ = true;
  for (std::size_t i = 0; i < ins.size(); ++i) open(site_of(ins[i].gateway), *added[i]);
  tend();
}

// One that is not meant has nobody in it, and looks as if nobody ran.
void DdsMiddleware::say_domains() const {
  std::string all;
  for (const auto& [id, site] : sites_) all += (all.empty() ? "" : ", ") + std::to_string(id);
  if (all.empty()) return;
  say(Level::kInfo, (sites_.size() == 1 ? "its topics are in DDS domain "
                                        : "its topics are in the DDS domains ") +
                        all);
}

void DdsMiddleware::stop() noexcept {
  started_ = false;
  for (auto& [id, site] : sites_) close(site);
  for (auto& [id, site] : sites_) {
    site.ends.clear();
    site.accounts.clear();
  }
  stall_thread_.reset();
  ins_.clear();
  for (OutTopic& out : outs_) out.tell_nobody();
}

bool DdsMiddleware::is_joining() const {
  return std::any_of(sites_.begin(), sites_.end(),
                     [](const auto& each) { return each.second.joining.valid(); });
}

shm::Nanoseconds DdsMiddleware::tend_period() const {
  const bool are_all_open = std::all_of(
      sites_.begin(), sites_.end(), [](const auto& each) { return each.second.domain != nullptr; });
  return are_all_open ? kStandingPeriod : kOpenAgain;
}

void DdsMiddleware::tend() {
  if (!started_) return;
  const std::uint64_t stops = guard_.stops();
  // To subscribe again, a participant is made, for which Cyclone waits while it joins a domain.
  const bool was_stopped = !is_joining() && std::exchange(stops_, stops) != stops;
  for (Site* const site : order_) {
    leave_for_new_peers(*site);
    if (!site->domain && !open(*site)) continue;
    try {
      site->domain->peers().update();
      if (was_stopped) subscribe_again(*site);
      for (EndPoint* const end : site->ends)
        end->look_at(site->domain->peers().of(end->topic().name));
    } catch (const DdsError& error) {  // an end that was opened again could not be
      give_up(*site, error);
    }
  }
}

// To join again is silence for all of the domain's topics: not where everybody has been found.
void DdsMiddleware::leave_for_new_peers(Site& site) {
  // Cyclone lets it wait while it joins another.
  if (!site.domain || is_joining()) return;
  const std::string change = site.peer_names->change();
  if (change.empty()) return;
  const bool is_anybody_missing = std::any_of(site.ends.begin(), site.ends.end(),
                                              [](const EndPoint* end) { return end->is_alone(); });
  if (!is_anybody_missing) return;
  say(Level::kWarning, "peers= of DDS domain " + std::to_string(site.domain->id()) + ": " + change +
                           ": joining the domain again");
  close(site);
  // Until then nobody is matched.
  for (Account* const account : site.accounts) {
    account->set_obstacle("its DDS domain is being joined again", false);
  }
  site.open_again = 0;
}

void DdsMiddleware::give_up(Site& site, const DdsError& error) {
  say(Level::kError, error.what());
  close(site);
  site.open_again = shm::monotonic_now() + kOpenAgain;
}

// A reliable publisher repeats what was lost while this process was stopped, perhaps seconds later,
// and it would look fresh. To a subscriber that is new it repeats nothing. The whole participant
// leaves, because Fast DDS does not notice when a single reader does.
void DdsMiddleware::subscribe_again(Site& site) {
  const auto each_reader = [&](auto call) {
    for (EndPoint* const end : site.ends) {
      if (end->which() == End::kReader) call(*end);
    }
  };
  bool is_any_reliable = false;
  each_reader([&](const EndPoint& end) {
    is_any_reliable = is_any_reliable || end.topic().qos.reliability == Reliability::kReliable;
  });
  if (!is_any_reliable) return;
  say(Level::kWarning,
      "the gateway did not run for a while: it subscribes again, lest publishers repeat what is "
      "old");
  each_reader([](EndPoint& end) { end.close(); });
  site.domain->leave_readers();
  each_reader([&](EndPoint& end) { end.open(*site.domain); });
}

void DdsMiddleware::set_problem(Site& site, const std::string& problem) {
  if (problem == site.problem) return;
  site.problem = problem;
  say(Level::kError, problem + "; trying again");
  for (Account* const account : site.accounts) account->set_obstacle(problem);
}

void DdsMiddleware::begin_to_join(Site& site) try {
  std::packaged_task<std::unique_ptr<Domain>()> join(
      [this, &site] { return join_domain(*site.gateway, site.topics, bell_, *site.peer_names); });
  auto joining = join.get_future();
  site.joiner = std::jthread([this, join = std::move(join)]() mutable {
    join();
    bell_.ring();
  });
  site.joining = std::move(joining);
} catch (const std::system_error& error) {
  throw DdsError(error.what());
}

bool DdsMiddleware::has_joined(Site& site) {
  auto patience = std::chrono::milliseconds(0);
  const shm::Nanoseconds now = shm::monotonic_now();
  if (!site.joining.valid()) {
    if (now < site.open_again || is_joining()) return false;
    site.open_again = now + kLongToJoin;
    low_descriptors_.let_go();
    begin_to_join(site);
    patience = kJoinsWithin;
  }
  if (site.joining.wait_for(patience) != std::future_status::ready) {
    if (now >= site.open_again) {
      set_problem(site,
                  "DDS is not joined yet: a name in peers= or in the configuration may be "
                  "one that no name server answers for");
    }
    return false;
  }
  site.domain = site.joining.get();
  site.joiner = {};
  hold_low_descriptors();
  return true;
}

bool DdsMiddleware::open(Site& site) {
  const CycloneWords words;
  try {
    if (!has_joined(site)) return false;
    for (EndPoint* const end : site.ends) end->open(*site.domain);
    site.problem.clear();
    words.tell();
    return true;
  } catch (const DdsError& error) {
    const std::string problem =
        words.last().empty() ? error.what() : "DDS cannot be joined: " + words.last();
    close(site);
    set_problem(site, problem);
    site.open_again = shm::monotonic_now() + kOpenAgain;
    return false;
  }
}

// A domain that is not open yet opens it with all others.
void DdsMiddleware::open(Site& site, EndPoint& end) {
  if (!site.domain) return;
  try {
    end.open(*site.domain);
  } catch (const DdsError& error) {
    give_up(site, error);
  }
}

void DdsMiddleware::close(Site& site) noexcept {
  for (EndPoint* const end : site.ends) end->close();
  site.joiner = {};  // waits for it
  site.joining = {};
  site.domain.reset();
  hold_low_descriptors();
}

}  // namespace arbiter::gateway::dds
