// DDS as a gateway's middleware, by Cyclone.
#pragma once

#include <future>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "gateway/core/bridge.hpp"
#include "gateway/core/freshness.hpp"
#include "gateway/core/middleware.hpp"
#include "gateway/core/stall_thread.hpp"
#include "gateway/dds/domain.hpp"
#include "gateway/dds/in_topic.hpp"
#include "gateway/dds/latched_samples.hpp"
#include "gateway/dds/low_descriptors.hpp"
#include "gateway/dds/out_topic.hpp"
#include "gateway/dds/peer_watch.hpp"
#include "gateway/mapping/mapping.hpp"

namespace arbiter::gateway::dds {

class DdsMiddleware : public Middleware {
 public:
  // Keeps references into the mappings. `bell`: rings where tend() has something to do. `latched`:
  // of the one before, and for the next one. Throws DdsError: two gateways of one domain are
  // configured differently, a topic goes out and comes in again within the domain that the
  // environment names, ROS_DOMAIN_ID is no number.
  DdsMiddleware(const std::vector<Mapping>& mappings, const Bell& bell, LatchedSamples& latched);
  ~DdsMiddleware() override;

  Sender& sender(const Gateway& gateway, const Entry& entry, Account& account) override;
  void start(const std::vector<OpenIn>& ins, const std::vector<OpenOut>& outs) override;
  void stop() noexcept override;
  void tend() override;
  [[nodiscard]] bool is_joining() const override;
  // Shorter while a domain is to be joined.
  [[nodiscard]] shm::Nanoseconds tend_period() const override;

 private:
  // One domain, which may not be there yet: a network interface that comes later, for example.
  struct Site {
    const Gateway* gateway = nullptr;
    std::set<std::string> topics;
    std::vector<const Entry*> entries;
    std::unique_ptr<PeerWatch> peer_names;
    // It may not be joined yet: Cyclone waits for a name server, perhaps for long.
    std::future<std::unique_ptr<Domain>> joining;
    std::jthread joiner;  // rings once that is ready
    std::unique_ptr<Domain> domain;
    shm::Nanoseconds open_again = 0;
    std::string problem;          // why it is not open, which has been said
    std::vector<EndPoint*> ends;  // each with its account
    std::vector<Account*> accounts;
  };

  static void refuse_circle(const Site& site, const Entry& entry);
  [[nodiscard]] Site& site_of(const Gateway& gateway);
  void add(Site& site, EndPoint& end, Account& account);
  void hold_low_descriptors() noexcept;
  void say_domains() const;
  // Says it, and so does each account.
  static void set_problem(Site& site, const std::string& problem);
  // Throws DdsError.
  void begin_to_join(Site& site);
  // False: not yet, or another one is being joined, for which Cyclone would let this one wait.
  // Throws DdsError.
  bool has_joined(Site& site);
  // False: not now, and each account says why.
  bool open(Site& site);
  void open(Site& site, EndPoint& end);
  // Until it is tried again.
  void give_up(Site& site, const DdsError& error);
  void close(Site& site) noexcept;
  // A name in peers= leads elsewhere, and somebody is missing who may be there: leaves the domain,
  // and says so.
  void leave_for_new_peers(Site& site);
  // Throws DdsError.
  static void subscribe_again(Site& site);

  const Bell& bell_;
  LatchedSamples& latched_;
  LowDescriptors low_descriptors_;
  StallGuard guard_;
  std::optional<StallThread> stall_thread_;
  std::map<dds_domainid_t, Site> sites_;
  // Joined in this order: while Cyclone looks up a name for one, no other is joined.
  std::vector<Site*> order_;
  std::list<OutTopic> outs_;
  std::map<std::string, OutTopic*> latching_;  // as LatchedSamples knows them
  std::map<const Entry*, OutTopic*> out_of_;
  std::list<InTopic> ins_;
  bool started_ = false;
  std::uint64_t stops_ = 0;  // of the guard, that have been dealt with
};

}  // namespace arbiter::gateway::dds
