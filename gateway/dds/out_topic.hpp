// An `out` entry: what an input port takes is published on a topic of DDS.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "gateway/core/announced.hpp"
#include "gateway/core/bridge.hpp"
#include "gateway/core/outgoing.hpp"
#include "gateway/dds/end_point.hpp"
#include "gateway/dds/latched_samples.hpp"
#include "gateway/dds/pace.hpp"
#include "gateway/dds/payload.hpp"

namespace arbiter::gateway::dds {

class OutTopic : public EndPoint, public Sender {
 public:
  // Keeps references.
  OutTopic(const Entry& entry, Account& account, const Bell& bell);
  ~OutTopic() override { close(); }

  // Who is told of each reader that comes.
  void tell(Outgoing& outgoing) noexcept { outgoing_.announce(outgoing); }
  void tell_nobody() noexcept { outgoing_.withdraw(); }

  // Whether those who come later are given what was sent last. Each end that is opened later sends
  // it again, unless the entry has an idle sample and something was to be sent meanwhile. What was
  // refused is sent again, too, once there is room.
  [[nodiscard]] bool latches() const;
  // Before it is opened.
  void begin_with(LastSample last) noexcept { last_ = std::move(last); }
  // For an entry like this. Null: there is none, or whoever begins anew sends the idle sample.
  [[nodiscard]] LastSample take_last() noexcept;

  // Waits a little for subscribers that do not keep up; after it has waited in vain, not again
  // until something could be sent: one that is cut off must not hold up the loop with each sample.
  // The gateway's loop.
  [[nodiscard]] Result send(Bytes sample) noexcept override;
  [[nodiscard]] Result send_at_once(Bytes sample) noexcept override;
  [[nodiscard]] std::size_t largest_at_once() const noexcept override { return pace_.largest(); }
  [[nodiscard]] WritableBytes draft(std::size_t bytes) noexcept override;
  [[nodiscard]] Result send_draft() noexcept override;
  void drop_draft() noexcept override;

 private:
  Entity make(dds_entity_t participant, dds_entity_t topic, const ddsi_sertype* type,
              const dds_qos_t* qos) override;
  [[nodiscard]] bool is_served() const override { return outgoing_.get() != nullptr; }
  [[nodiscard]] std::uint32_t matched() const override;
  void begin() noexcept override;
  void catch_up() noexcept override;
  // On Cyclone's threads.
  void on_matched(const dds_publication_matched_status_t& status) noexcept;
  // Whether send() may, for room.
  [[nodiscard]] bool may_wait() noexcept;
  // Why a sample cannot be written; empty: it can. With in_use(), as the next one.
  std::optional<Result> obstacle(Bytes sample) noexcept;
  // Was not sent, but is what those are to be told who come later: not the one before. With
  // in_use().
  void keep_untold(Bytes sample) noexcept;
  // Takes over a reference.
  Result write(Payload& payload) noexcept;
  Result refuse(const std::string& why) noexcept;

  const Bell& bell_;
  const Representation representation_;
  const ddsi_sertype* type_ = nullptr;
  const bool has_idle_sample_;
  // That was sent, or was to be sent while this was closed or had no room, if the entry latches;
  // with in_use().
  LastSample last_;
  bool has_waited_in_vain_ = false;  // of send(), for room; with in_use()
  // Of whoever has the entry's turn, as is note() of the next one.
  Payload* draft_ = nullptr;
  bool is_draft_begun_ = false;  // Cyclone counts references to it
  // As Cyclone has told last: to ask it takes a few locks. Relaxed is enough: it says only whether
  // a time is worth noting.
  std::atomic<std::uint32_t> readers_{0};
  Pace pace_;
  Announced<Outgoing> outgoing_;
};

}  // namespace arbiter::gateway::dds
