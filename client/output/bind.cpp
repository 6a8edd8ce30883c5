// The port's thread takes up a view, and binds the rules of the model in force.
#include <algorithm>
#include <utility>

#include "client/count.hpp"
#include "client/output/output_core.hpp"

namespace arbiter::detail {

// Leaves what has gone, joins what has come.
void OutputCore::accept_view() noexcept {
  std::unique_ptr<OutputView> view = handover_.accept();
  if (view == nullptr) return;
  leave_all_but(*view);
  pool_.grow(view->slots);
  std::vector<Destination> destinations;
  destinations.reserve(view->links.size());
  decisions_.reserve(view->links.size());
  for (const InputLink& link : view->links) {
    Destination destination;
    for (const Destination& old : destinations_) {
      if (old.peer == link.peer.get()) destination = old;
    }
    destination.peer = link.peer.get();
    destination.refused = link.refused;
    destination.mask = link.mask;
    if (link.channel != shm::kNone && !destination.joined && !destination.awaited) {
      destination.awaited = true;
      destination.link = link.number;
      destination.channel = link.channel;
      destination.depth = link.depth;
      destination.missed = 0;
      destination.writer = shm::ChannelWriter(segment_, link.channel);
    }
    destinations.push_back(std::move(destination));
  }
  destinations_ = std::move(destinations);
  join_awaited();
  teller_.accept(view->taps, state(), pool_);
  handover_.retire(std::exchange(view_, std::move(view)));
  memory_->service_bell().ring();  // to dispose of the old one
  bound_epoch_ = settled_epoch_ = UINT64_MAX;
  // (b) for the queues that we left, and for what is kept for taps no longer: their slots may be
  // reclaimed before the next publish.
  shm::full_fence();
}

void OutputCore::leave_all_but(const OutputView& view) noexcept {
  for (Destination& destination : destinations_) {
    if (!destination.joined && !destination.awaited) continue;
    const bool stays =
        std::any_of(view.links.begin(), view.links.end(), [&](const InputLink& link) {
          return link.peer.get() == destination.peer && link.number == destination.link &&
                 link.channel == destination.channel;
        });
    if (stays) continue;
    if (destination.joined) {
      destination.writer.leave([&](std::uint32_t slot) { pool_.evict(slot); });
    }
    destination.joined = destination.awaited = false;
    destination.channel = shm::kNone;
  }
}

// The ring names its reader by the link: another for each, lest a port that was disconnected and
// connected again takes the old queue for the new one.
void OutputCore::join(Destination& destination) noexcept {
  destination.writer.join(destination.link, destination.peer->port, destination.depth);
  count(destination.writer.channel().discarded, destination.missed);
  destination.joined = true;
  destination.awaited = false;
}

// An arbitrated port drops what waits in a queue that it comes to know late, if it has taken
// something later meanwhile: it lost when that was taken. One that keeps, or takes, all that is
// accepted would get it behind the later sample: its queue begins once its process has taken up the
// link. Relaxed is enough (InputCore::take_up() says why).
void OutputCore::join_awaited() noexcept {
  has_awaited_ = false;
  const shm::TableSnapshot now = memory_->tables().snapshot();
  for (Destination& destination : destinations_) {
    if (!destination.awaited) continue;
    const InputPeer& peer = *destination.peer;
    const bool drops = !peer.keep && now.table.is_arbitrated(peer.port);
    const auto& newest_link = peer.segment->header.newest_link;
    if (drops || newest_link.load(std::memory_order_relaxed) >= destination.link) {
      join(destination);
    } else {
      has_awaited_ = true;
    }
  }
}

bool OutputCore::is_settled() const noexcept {
  return memory_->tables().epoch() == settled_epoch_ && memory_->pages().changes() == bound_pages_;
}

void OutputCore::settle() noexcept {
  if (rules_are_bound()) {
    join_awaited();
  } else {
    rebind_view();
  }
  settled_epoch_ = has_awaited_ ? UINT64_MAX : bound_epoch_;
}

bool OutputCore::rules_are_bound() const noexcept {
  return memory_->tables().epoch() == bound_epoch_ && memory_->pages().changes() == bound_pages_;
}

// Again where seven models were loaded meanwhile, for T is used before a decision checks the table.
void OutputCore::bind_rules() noexcept {
  for (int tries = 0; tries <= kMaxTableRetries; ++tries) {
    read_table();
    bind_decisions();
    if (memory_->tables().is_whole(snapshot_)) return;
  }
}

void OutputCore::bind_table() noexcept {
  for (int tries = 0; tries <= kMaxTableRetries; ++tries) {
    read_table();
    if (memory_->tables().is_whole(snapshot_)) return;
  }
}

void OutputCore::read_table() noexcept {
  bound_pages_ = memory_->pages().changes();
  snapshot_ = memory_->tables().snapshot();
  bound_epoch_ = snapshot_.epoch;
  timeout_ = snapshot_.table.timeout(source_);
}

void OutputCore::bind_decisions() noexcept {
  decisions_.clear();
  std::size_t reads = 0;
  for (Destination& destination : destinations_) {
    if (!destination.joined && !destination.refused && !destination.awaited) continue;
    const shm::TableView& table = snapshot_.table;
    const shm::Rule rule = table.rule(table.find(source_, destination.peer->port));
    destination.has_rule = rule.source != shm::kNone;
    const auto same = std::find_if(
        decisions_.begin(), decisions_.end(),
        [&](const SharedDecision& decision) { return decision.rule.decides_as(rule); });
    destination.decision = static_cast<std::uint32_t>(same - decisions_.begin());
    if (same != decisions_.end()) continue;
    decisions_.push_back({rule, {}, {}});
    reads += shm::BoundRule::reads_of(rule);
  }
  reads_.resize(std::max(reads_.size(), reads));
  shm::Read* next = reads_.data();
  for (SharedDecision& decision : decisions_) {
    decision.bound.bind(decision.rule, memory_->pages(), next, false);
    next += shm::BoundRule::reads_of(decision.rule);
  }
}

}  // namespace arbiter::detail
