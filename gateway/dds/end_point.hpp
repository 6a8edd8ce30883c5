// One end of a topic of DDS that is ours: what the readers and the writers of a gateway share.
//
// Thread safety: one thread, the gateway's loop. Another one may use end() while it holds in_use().
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/core/account.hpp"
#include "gateway/dds/domain.hpp"
#include "gateway/dds/entity.hpp"
#include "gateway/dds/mismatch.hpp"
#include "gateway/dds/peers.hpp"
#include "gateway/dds/warnings.hpp"
#include "gateway/mapping/mapping.hpp"

namespace arbiter::gateway::dds {

class EndPoint {
 public:
  EndPoint(const EndPoint&) = delete;
  EndPoint& operator=(const EndPoint&) = delete;
  virtual ~EndPoint() = default;

  // Opens it in the domain, which outlives it or close(). Throws DdsError.
  void open(Domain& domain);
  void close() noexcept;
  [[nodiscard]] bool is_open() const { return static_cast<bool>(end_); }
  // Open, and nobody has been matched.
  [[nodiscard]] bool is_alone() const { return is_open() && matched() == 0; }

  // Takes account of who is out there: opens it again with or without a key where nothing else
  // would match, takes on ROS 2's type hash, and says who does not match, and why.
  // `peers`: of its topic.
  void look_at(const PeersOfTopic& peers);

  [[nodiscard]] End which() const { return which_; }
  [[nodiscard]] const DdsTopic& topic() const { return topic_; }
  [[nodiscard]] bool keyed() const { return keyed_; }

 protected:
  // Keeps references.
  EndPoint(End end, const Entry& entry, Account& account);

  // Makes the reader or the writer. `type`: what Cyclone knows the topic's samples by.
  [[nodiscard]] virtual Entity make(dds_entity_t participant, dds_entity_t topic,
                                    const ddsi_sertype* type, const dds_qos_t* qos) = 0;
  // It is open, and in use by this call.
  virtual void begin() noexcept {}
  // Now and then, while it is open.
  virtual void catch_up() noexcept {}
  // What it asks for now; the mapping's, if it may have that.
  [[nodiscard]] virtual Durability durability() const { return entry_.dds->qos.durability; }
  // Why that is less than the mapping's: "T is not forever".
  [[nodiscard]] virtual std::string_view why_less_durable() const { return {}; }
  // Whether its port is open here: what else is at the topic of one that is not served is for
  // whoever serves it to say.
  [[nodiscard]] virtual bool is_served() const { return true; }
  // How many peers Cyclone has matched.
  [[nodiscard]] virtual std::uint32_t matched() const = 0;

  [[nodiscard]] const Entity& end() const { return end_; }
  // Held, it keeps the entity from being closed.
  [[nodiscard]] std::mutex& in_use() const { return in_use_; }
  [[nodiscard]] const Entry& entry() const { return entry_; }
  [[nodiscard]] Account& account() const { return account_; }
  // Of a sample of so many bytes that cannot be of a type whose size is known: "the last bad sample
  // has 8 bytes; geometry_msgs/msg/Twist has 52".
  [[nodiscard]] std::string wrong_size(std::size_t bytes) const;

 private:
  void open();
  void choose_kind(const PeerMap& peers);
  void choose_durability();
  void adopt_type_hash(const PeerMap& peers);
  void find_obstacles(const PeersOfTopic& peers);
  void tell_obstacles(std::uint32_t count);  // of matched peers
  void warn();

  const End which_;
  const Entry& entry_;
  DdsTopic topic_;  // the entry's, with the durability that is open
  Account& account_;
  Domain* domain_ = nullptr;
  bool keyed_;
  std::string type_hash_;
  std::optional<std::uint64_t> seen_;   // the peers' revision; empty: look at them
  std::string_view why_less_durable_;   // as it was told last
  bool was_served_ = false;             // likewise
  std::vector<std::string> obstacles_;  // who does not match, and who goes past Arbiter
  bool has_mismatches_ = false;         // among them
  bool is_trouble_ = false;             // as Account::is_trouble()
  Warnings warnings_;
  Entity topic_entity_;
  mutable std::mutex in_use_;
  Entity end_;
};

}  // namespace arbiter::gateway::dds
