#include "client/output_core.hpp"

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "client/count.hpp"

namespace arbiter::detail {
namespace {

// Beside the loans, one slot for publish() with a copy.
std::uint32_t slots_of_our_own(std::uint32_t max_loans) { return max_loans + 1; }

std::uint64_t stride_of(const shm::TypeInfo& type) {
  return shm::OutputLayout::plan(type, 1).stride;
}

std::uint32_t reserved_slots(const shm::TypeInfo& type, const OutputPortOptions& options) {
  const std::uint64_t fit = options.max_memory / stride_of(type);
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(fit, shm::kMaxSlots));
}

// How often a decision is taken anew because seven models were loaded during it.
constexpr int kMaxTableRetries = 3;

}  // namespace

// One sample to be held and one to wait, beside our own.
std::uint64_t OutputCore::least_memory(const shm::TypeInfo& type, std::uint32_t max_loans) {
  return stride_of(type) * (slots_of_our_own(max_loans) + std::uint64_t{2});
}

OutputCore::OutputCore(std::string name, const shm::TypeInfo& type,
                       const OutputPortOptions& options, std::shared_ptr<SharedMemory> memory)
    : name_(std::move(name)),
      type_(type),
      max_loans_(options.max_loans),
      memory_(std::move(memory)) {
  const auto layout = shm::OutputLayout::plan(type_, reserved_slots(type_, options));
  descriptor_ = shm::make_segment("arbiter-output", layout.total_size);
  mapping_ = shm::Mapping(descriptor_, layout.total_size, shm::Access::kReadWrite);
  segment_ = shm::OutputSegment(mapping_.data(), layout);
  if (const auto error = shm::allocate(descriptor_, 0, layout.rings_offset)) {
    throw std::system_error(error, "allocating an output port");
  }
  shm::OutputHeader& header = segment_.header();
  header.magic = shm::OutputHeader::kMagic;
  header.version = shm::OutputHeader::kVersion;
  header.slot_count = layout.slot_count;
  header.stride = layout.stride;
  header.headers_offset = layout.headers_offset;
  header.payload_offset = layout.payload_offset;
  header.total_size = layout.total_size;
  header.type = type_;
  allocate_slots();
  pool_.grow(allocated_slots_);
  shm::seal(descriptor_, shm::Seals::kOneWriter);
}

void OutputCore::bind(shm::PortInstance instance, shm::SourceId source,
                      const shm::FileDescriptor& page) {
  if (shm::checked_size(page, shm::Seals::kFixedSize) != sizeof(shm::ActivityPage)) {
    throw std::runtime_error("the activity page has another size");
  }
  page_ = shm::Mapping(page, sizeof(shm::ActivityPage), shm::Access::kReadWrite);
  activity_ = &page_.as<shm::ActivityPage>()->activity;
  own_word_ = activity_->word.load(std::memory_order_relaxed);  // a predecessor's: it carries on
  instance_ = instance;
  source_ = source;
}

// Service thread.

void OutputCore::add_peer(std::shared_ptr<const InputPeer> peer, std::uint64_t number) {
  const auto instance = peer->instance;
  InputLink& link = links_[instance];
  if (link.peer == nullptr) link.peer = std::move(peer);
  link.connected = number != 0;
  link.number = number;
  try {
    if (link.connected) assign_channel(link);
    allocate_slots();
  } catch (...) {
    link.connected = false;
    link.channel = shm::kNone;
    offer_view();
    throw;
  }
  offer_view();
}

void OutputCore::remove_peer(shm::PortInstance peer) {
  if (links_.erase(peer) != 0) offer_view();
}

void OutputCore::disconnect_peer(shm::PortInstance peer) {
  const auto found = links_.find(peer);
  if (found == links_.end()) return;
  found->second.connected = false;
  found->second.channel = shm::kNone;
  offer_view();
}

void OutputCore::tidy() { handover_.collect(); }

void OutputCore::assign_channel(InputLink& link) {
  if (link.channel != shm::kNone) return;
  std::uint64_t used = 0;
  for (const auto& [instance, other] : links_) {
    if (other.channel != shm::kNone) used |= std::uint64_t{1} << other.channel;
  }
  if (used == UINT64_MAX) return;  // until one is free: offer_view() tries again
  link.channel = static_cast<std::uint32_t>(__builtin_ctzll(~used));
  link.depth = 0;  // for allocate_slots() to say
  const std::size_t ring = sizeof(shm::Atomic<shm::Entry>) * shm::kMaxDepth;
  const auto offset = segment_.layout().rings_offset + ring * link.channel;
  if (const auto error = shm::allocate(descriptor_, offset, ring)) {
    throw std::system_error(error, "allocating a queue");
  }
}

// Allocates as many slots as all links can need at worst (slot_pool.hpp). Where max_memory does not
// allow it, the queues that have come last get a smaller depth; one that has begun keeps its own.
void OutputCore::allocate_slots() {
  std::uint64_t needed = slots_of_our_own(max_loans_);
  for (const auto& [instance, link] : links_) {
    needed += link.peer->max_held + (link.channel == shm::kNone ? 0 : link.depth);
  }
  const std::uint64_t reserved = segment_.layout().slot_count;
  for (auto& [instance, link] : links_) {
    if (link.channel == shm::kNone || link.depth != 0) continue;
    if (needed >= reserved) {
      throw std::runtime_error("max_memory of " + name_ + " leaves no room for another input port");
    }
    link.depth =
        static_cast<std::uint32_t>(std::min<std::uint64_t>(link.peer->depth, reserved - needed));
    needed += link.depth;
  }
  const auto wanted = static_cast<std::uint32_t>(std::min(needed, reserved));
  if (wanted <= allocated_slots_) return;
  const shm::OutputLayout& layout = segment_.layout();
  const auto headers = shm::allocate(descriptor_, layout.headers_offset,
                                     sizeof(shm::SlotHeader) * std::size_t{wanted});
  const auto payload = shm::allocate(descriptor_, layout.payload_offset, layout.stride * wanted);
  if (headers || payload) {
    throw std::system_error(headers ? headers : payload, "allocating samples of " + name_);
  }
  allocated_slots_ = wanted;
}

// For a link that found all channels in use when it came.
void OutputCore::connect_waiting(InputLink& link) noexcept {
  try {
    assign_channel(link);
    allocate_slots();
  } catch (const std::exception&) {  // no memory: it stays unconnected
    link.connected = false;
    link.channel = shm::kNone;
  }
}

void OutputCore::offer_view() {
  auto view = std::make_unique<OutputView>();
  for (auto& [instance, link] : links_) {
    if (link.connected && link.channel == shm::kNone) connect_waiting(link);
    view->links.push_back(link);
  }
  view->slots = allocated_slots_;
  handover_.offer(std::move(view));
}

// Port's thread.

// Leaves what has gone, joins what has come.
void OutputCore::accept_view() noexcept {
  std::unique_ptr<OutputView> view = handover_.accept();
  if (view == nullptr) return;
  leave_all_but(*view);
  pool_.grow(view->slots);
  std::vector<Destination> destinations;
  destinations.reserve(view->links.size());
  for (const InputLink& link : view->links) {
    Destination destination;
    for (const Destination& old : destinations_) {
      if (old.peer == link.peer.get()) destination = old;
    }
    destination.peer = link.peer.get();
    if (link.channel != shm::kNone && !destination.joined) {
      destination.joined = true;
      destination.link = link.number;
      destination.channel = link.channel;
      destination.writer = shm::ChannelWriter(segment_, link.channel);
      // What the ring names its reader by: another for each link, lest a port that was disconnected
      // and connected again takes the old queue for the new one.
      destination.writer.join(link.number, link.peer->port, link.depth);
    }
    destinations.push_back(std::move(destination));
  }
  destinations_ = std::move(destinations);
  handover_.retire(std::exchange(view_, std::move(view)));
  memory_->service_bell().ring();  // to dispose of the old one
  bound_generation_ = UINT64_MAX;
  // (b) for the queues that we left: their slots may be reclaimed before the next publish.
  shm::full_fence();
}

void OutputCore::leave_all_but(const OutputView& view) noexcept {
  for (Destination& destination : destinations_) {
    if (!destination.joined) continue;
    const bool stays =
        std::any_of(view.links.begin(), view.links.end(), [&](const InputLink& link) {
          return link.peer.get() == destination.peer && link.number == destination.link &&
                 link.channel == destination.channel;
        });
    if (stays) continue;
    destination.writer.leave([&](std::uint32_t slot) { pool_.evict(slot); });
    destination.joined = false;
    destination.channel = shm::kNone;
  }
}

// Again where seven models were loaded meanwhile, for T is used before a decision checks the table.
void OutputCore::bind_rules() noexcept {
  for (int tries = 0; tries <= kMaxTableRetries; ++tries) {
    snapshot_ = memory_->tables().snapshot();
    bound_generation_ = snapshot_.generation;
    timeout_ = snapshot_.table.timeout(source_);
    for (Destination& destination : destinations_) {
      const auto index = snapshot_.table.find(source_, destination.peer->port);
      destination.rule = snapshot_.table.rule(index);
    }
    if (memory_->tables().is_whole(snapshot_)) return;
  }
}

std::uint32_t OutputCore::acquire_slot() noexcept {
  return pool_.acquire(instance_, [&](auto&& each) {
    for (const Destination& destination : destinations_) {
      each(destination.peer->segment->header.holds, destination.peer->max_held);
    }
  });
}

LoanedSlot OutputCore::loan(std::size_t size) noexcept {
  if (handover_.has_offer()) accept_view();
  if (size > type_.size || loans_ == max_loans_) return {};
  const std::uint32_t slot = acquire_slot();
  if (slot == shm::kNoSlot) {
    count(segment_.header().counters.no_slot);
    return {};
  }
  ++loans_;
  return {segment_.payload(slot), slot};
}

void OutputCore::end_loan(std::uint32_t slot) noexcept {
  --loans_;
  pool_.end_loan(slot);
}

// SYNC POINT: stamped. Fence (a) stands between our stamp and our reading of other stamps, and
// before publish() returns. It pairs with fence (a) of other publishers (of two that override each
// other, at least one sees the other), with fence (d) of a receiver about to wait, and gives the
// guarantee that no take() which begins after publish() has returned misses the stamp.
void OutputCore::stamp(shm::ActivityWord word) noexcept {
  if (shm::is_deactivation(word)) {
    activity_->word.store(word, std::memory_order_relaxed);
  } else {
    activity_->arrive(own_word_, word);
  }
  own_word_ = word;
  shm::full_fence();
}

Outcome OutputCore::arrive(std::uint32_t slot, std::size_t size, shm::Nanoseconds now) noexcept {
  if (handover_.has_offer()) accept_view();
  if (memory_->tables().generation() != bound_generation_) bind_rules();
  const bool begins = !shm::is_active(own_word_, now);
  stamp(shm::arrival(now, timeout_));
  Outcome outcome;
  if (!destinations_.empty()) {
    decide_all(now);
    outcome = hand_over(slot, size, now);
    if (begins) ring_where_selection_changed(now);
  }
  auto& counters = segment_.header().counters;
  count(slot == shm::kNoSlot ? counters.signals : counters.published);
  return outcome;
}

void OutputCore::decide_all(shm::Nanoseconds now) noexcept {
  for (int tries = 0;; ++tries) {
    shm::DecisionClock clock(now, true);
    shm::Decider decider(snapshot_.table, memory_->pages(), clock);
    for (Destination& destination : destinations_) {
      if (destination.joined) destination.verdict = decider.decide(destination.rule);
    }
    if (memory_->tables().is_whole(snapshot_)) return;
    if (tries == kMaxTableRetries) break;
    bind_rules();
  }
  for (Destination& destination : destinations_) destination.verdict = shm::Verdict::kUnsettled;
}

Outcome OutputCore::hand_over(std::uint32_t slot, std::size_t size, shm::Nanoseconds now) noexcept {
  Outcome outcome;
  const bool is_sample = slot != shm::kNoSlot;
  if (is_sample) {
    shm::SlotHeader& header = segment_.slot_header(slot);
    header.sequence.store(++sequence_, std::memory_order_relaxed);
    header.stamp.store(now, std::memory_order_relaxed);
    header.size.store(size, std::memory_order_relaxed);
  }
  std::uint64_t blind = 0;
  std::uint64_t unsettled = 0;
  for (Destination& destination : destinations_) {
    if (!destination.joined || destination.rule.source == shm::kNone) continue;
    blind += destination.verdict == shm::Verdict::kBlind;
    unsettled += destination.verdict == shm::Verdict::kUnsettled;
    if (destination.verdict != shm::Verdict::kWins) {
      ++outcome.discarded;
      if (is_sample) count(destination.writer.channel().discarded, 1);
      continue;
    }
    if (!is_sample) continue;
    if (destination.peer->refuse_new && is_full(destination)) {
      destination.verdict = shm::Verdict::kLoses;  // nothing to ring for
      ++outcome.refused;
      count(destination.writer.channel().refused, 1);
      continue;
    }
    ++outcome.delivered;
    pool_.add_reference(slot);
    const std::uint32_t evicted = destination.writer.push(slot);
    if (evicted != shm::kNoSlot) pool_.evict(evicted);
  }
  if (outcome.delivered != 0) {
    // SYNC POINT: entry-announced. Fence (b), between our entries and our reading of wait words and
    // holds. Pairs with fence (d) of a receiver about to wait: either it sees the entry, or we see
    // it wait; and with fence (c) of a receiver that takes hold (channel.hpp).
    shm::full_fence();
    for (Destination& destination : destinations_) {
      if (destination.joined && destination.verdict == shm::Verdict::kWins)
        ring_if_waiting(destination);
    }
  }
  auto& counters = segment_.header().counters;
  if (is_sample) {
    count(counters.delivered, outcome.delivered);
    count(counters.discarded, outcome.discarded);
    count(counters.refused, outcome.refused);
  }
  count(counters.blind, blind);
  count(counters.unsettled, unsettled);
  return outcome;
}

// The receiver's lane for us tells how far it has read; until it has one, it has read nothing.
bool OutputCore::is_full(Destination& destination) const noexcept {
  const shm::InputSegment& segment = *destination.peer->segment;
  const auto is_ours = [&](const shm::Lane& lane) {
    return lane.publisher.load(std::memory_order_acquire) == instance_;
  };
  if (destination.lane == nullptr || !is_ours(*destination.lane)) {
    destination.lane = nullptr;
    for (const shm::Lane& lane : segment.lanes) {
      if (is_ours(lane)) destination.lane = &lane;
    }
  }
  const std::uint64_t nothing_read =
      destination.writer.channel().first.load(std::memory_order_relaxed) - 1;
  const std::uint64_t consumed = destination.lane == nullptr
                                     ? nothing_read
                                     : destination.lane->consumed.load(std::memory_order_acquire);
  return destination.writer.is_full(std::max(consumed, nothing_read));
}

void OutputCore::ring_if_waiting(Destination& destination) noexcept {
  const std::uint64_t wait = destination.peer->segment->header.wait.load(std::memory_order_acquire);
  if ((wait & 1) == 0 || wait == destination.rung) return;
  destination.rung = wait;
  destination.peer->ringer.ring();
}

// Our activity has begun or ended. A component that waits, and believes of its port what is no
// longer so, is woken: to stop its motor, or to know when it will have to.
void OutputCore::ring_where_selection_changed(shm::Nanoseconds now) noexcept {
  for (Destination& destination : destinations_) {
    const std::uint64_t wait =
        destination.peer->segment->header.wait.load(std::memory_order_acquire);
    if ((wait & 1) == 0 || wait == destination.rung) continue;
    if (selection_differs(destination, now)) ring_if_waiting(destination);
  }
}

bool OutputCore::selection_differs(const Destination& destination, shm::Nanoseconds now) noexcept {
  const shm::SourceId believed =
      destination.peer->segment->header.believed.load(std::memory_order_relaxed);
  const shm::TableView& table = snapshot_.table;
  shm::DecisionClock clock(now, true);
  shm::Decider decider(table, memory_->pages(), clock);
  const auto range = table.connections_to(destination.peer->port);
  for (auto index = range.first; index != range.first + range.count; ++index) {
    const shm::Rule rule = table.rule(index);
    const shm::Verdict verdict = decider.decide_with_own(rule);
    if (verdict == shm::Verdict::kWins) return believed != rule.source;
    if (verdict != shm::Verdict::kLoses) return true;  // not known here: let it look for itself
  }
  return believed != shm::kNone;
}

Outcome OutputCore::publish_loan(std::uint32_t slot, std::size_t size,
                                 shm::Nanoseconds now) noexcept {
  const Outcome outcome = arrive(slot, size, now);
  end_loan(slot);
  return outcome;
}

Outcome OutputCore::publish_copy(const void* data, std::size_t size,
                                 shm::Nanoseconds now) noexcept {
  if (handover_.has_offer()) accept_view();
  const std::uint32_t slot = acquire_slot();
  if (slot == shm::kNoSlot) {
    count(segment_.header().counters.no_slot);
    return signal(now);  // it did arrive
  }
  if (size != 0) std::memcpy(segment_.payload(slot), data, size);
  const Outcome outcome = arrive(slot, size, now);
  pool_.end_loan(slot);
  return outcome;
}

Outcome OutputCore::signal(shm::Nanoseconds now) noexcept { return arrive(shm::kNoSlot, 0, now); }

void OutputCore::deactivate(shm::Nanoseconds now) noexcept {
  if (handover_.has_offer()) accept_view();
  if (memory_->tables().generation() != bound_generation_) bind_rules();
  const bool ends = shm::is_active(own_word_, now);
  stamp(shm::deactivation(now));
  if (ends) ring_where_selection_changed(now);
}

}  // namespace arbiter::detail
