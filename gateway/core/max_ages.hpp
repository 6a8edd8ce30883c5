// How old samples of each source may be: T of the model in force, which changes with reloads and
// switches, bounded by the entry's max_age=.
//
// For T = forever it is the entry's max_age, else the model's own timeout, else (where that is
// forever, too) 500 ms. Thread: the gateway's loop.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/core/freshness.hpp"
#include "gateway/mapping/mapping.hpp"
#include "shm/activity.hpp"
#include "shm/table_ring.hpp"
#include "watch/instance.hpp"

namespace arbiter::gateway {

// Of a source by its T, the model's timeout and the entry's max_age.
[[nodiscard]] shm::Nanoseconds max_age_of(shm::Nanoseconds timeout, shm::Nanoseconds of_model,
                                          const std::optional<shm::Nanoseconds>& max_age);

class MaxAges final : public AgesOfSources {
 public:
  // `instance`: as NodeOptions has it. Joins it as a watcher once there is a daemon that lets it;
  // until then each age is as without a model.
  explicit MaxAges(std::string instance);

  // `age` belongs to the caller and is written by update(), also by this call.
  void add(const Entry& entry, MaxAge& age);
  // Reads memory, and the daemon's news; does not wait. Call it where there is news, and twice a
  // second. True: another model may be in force than before, or what is known of T has changed.
  bool update();
  // Whether another model may be in force than at the last update(): one load.
  [[nodiscard]] bool is_outdated() const;
  // Readable when the daemon has said something; negative: it has not let us in yet.
  [[nodiscard]] int descriptor() const noexcept {
    return instance_ == nullptr ? -1 : instance_->descriptor();
  }
  [[nodiscard]] shm::Nanoseconds of(std::string_view source) const override;
  // The daemon that it knew has gone, and no other has come yet.
  [[nodiscard]] bool knows_of_no_daemon() const noexcept {
    return instance_ != nullptr && !instance_->has_daemon();
  }
  // Whether the daemon does not know what the node of that name in this process has open
  // (turned_away.hpp). It is asked once a second, where it has other memory than the first one; who
  // may not `observe` does not learn it.
  [[nodiscard]] bool is_turned_away(std::string_view node);
  // What keeps it from knowing T, such as a policy that does not allow this user to `observe`;
  // empty: nothing.
  [[nodiscard]] const std::string& obstacle() const noexcept { return obstacle_; }

 private:
  struct Watched {
    const Entry* entry;
    MaxAge* age;
  };

  void join();
  [[nodiscard]] bool has_other_memory() const;
  // T of a source by the model in force, and that model's own.
  struct Timeouts {
    shm::Nanoseconds own = shm::kDefaultTimeout;
    shm::Nanoseconds of_model = shm::kDefaultTimeout;
  };
  [[nodiscard]] Timeouts timeouts_of(std::string_view source) const;

  const std::string instance_name_;
  std::unique_ptr<watch::Instance> instance_;
  std::string obstacle_;
  std::shared_ptr<const shm::DecisionMemory> first_;  // of the daemon that was joined first
  shm::Nanoseconds join_again_ = 0;
  shm::Nanoseconds ask_again_ = 0;  // whether it has turned the node away
  shm::Epoch epoch_ = 0;            // of the tables, at the last update()
  std::vector<Watched> watched_;
};

}  // namespace arbiter::gateway
