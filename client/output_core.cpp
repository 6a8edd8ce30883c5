#include "client/output_core.hpp"

#include <fcntl.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "client/types.hpp"

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

}  // namespace

// One sample to be held and one to wait, beside our own.
std::uint64_t OutputCore::least_memory(const shm::TypeInfo& type, std::uint32_t max_loans) {
  return stride_of(type) * (slots_of_our_own(max_loans) + std::uint64_t{2});
}

OutputCore::OutputCore(std::string name, const Type& type, const OutputPortOptions& options,
                       std::shared_ptr<SharedMemory> memory)
    : name_(std::move(name)),
      declared_type_(type),
      type_(as_info(type)),
      max_loans_(options.max_loans),
      memory_(std::move(memory)) {
  const auto layout = shm::OutputLayout::plan(type_, reserved_slots(type_, options));
  descriptor_ = shm::make_segment("arbiter-output", layout.total_size);
  mapping_ = shm::Mapping(descriptor_, layout.total_size, shm::Access::kReadWrite);
  segment_ = shm::OutputSegment(mapping_.data(), layout);
  if (const auto error = shm::allocate(descriptor_, 0, layout.rings_offset)) {
    throw std::system_error(error, "allocating an output port");
  }
  shm::make_resident(mapping_, 0, layout.rings_offset, memory_->residence());
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
  bequest_.emplace(mapping_.data(), mapping_.size(), shm::Bequest::Kind::kPrivateZeros);
  shm::close_in_children(descriptor_);
  readable_ = shm::reopen(descriptor_, O_RDONLY);
  shm::close_in_children(readable_);
}

void OutputCore::bind(shm::PortInstance instance, shm::SourceId source, shm::FileDescriptor page) {
  if (shm::checked_size(page, shm::Seals::kFixedSize) != sizeof(shm::ActivityPage)) {
    throw std::runtime_error("the activity page has another size");
  }
  page_ = shm::Mapping(page, sizeof(shm::ActivityPage), shm::Access::kReadWrite);
  activity_ = &page_.as<shm::ActivityPage>()->of(source);
  own_word_ = activity_->word.load(std::memory_order_relaxed);  // a predecessor's: it carries on
  shm::make_resident(page_, 0, sizeof(shm::ActivityPage), memory_->residence());
  page_bequest_.emplace(page_.data(), page_.size(), shm::Bequest::Kind::kPrivateZeros);
  page_descriptor_ = std::move(page);
  shm::close_in_children(page_descriptor_);
  instance_ = instance;
  source_ = source;
}

// Service thread.

void OutputCore::add_peer(std::shared_ptr<const InputPeer> peer, std::uint64_t number) {
  const auto instance = peer->instance;
  InputLink& link = links_[instance];
  if (link.peer == nullptr || !link.peer->is_mapped) link.peer = std::move(peer);
  link.connected = number != 0;
  link.refused = false;
  link.number = number;
  try {
    if (link.connected) assign_channel(link);
    allocate_slots();
  } catch (...) {
    link.connected = false;
    link.refused = true;
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
  found->second.refused = false;
  found->second.channel = shm::kNone;
  offer_view();
}

void OutputCore::refuse_peer(shm::PortInstance peer, shm::PortId port) {
  InputLink& link = links_[peer];
  if (link.peer == nullptr) link.peer = unmapped_input_peer(peer, port);
  link.connected = false;
  link.refused = true;
  link.channel = shm::kNone;
  offer_view();
}

std::vector<HeldLink> OutputCore::held_links() const {
  std::vector<HeldLink> held;
  for (const auto& [peer, link] : links_) held.push_back({peer, link.connected ? link.number : 0});
  return held;
}

void OutputCore::tidy() { handover_.collect(); }

std::vector<shm::PortInstance> OutputCore::misbehaving() {
  std::vector<shm::PortInstance> found;
  for (const auto& [instance, link] : links_) {
    if (link.connected && link.peer->misbehaved.load(std::memory_order_relaxed)) {
      found.push_back(instance);
    }
  }
  for (const shm::PortInstance peer : found) refuse_peer(peer, links_.at(peer).peer->port);
  return found;
}

void OutputCore::assign_channel(InputLink& link) {
  if (link.channel != shm::kNone) return;
  std::uint64_t used = 0;
  for (const auto& [instance, other] : links_) {
    if (other.channel != shm::kNone) used |= std::uint64_t{1} << other.channel;
  }
  if (used == UINT64_MAX) return;  // until one is free: offer_view() tries again
  link.channel = static_cast<std::uint32_t>(__builtin_ctzll(~used));
  link.depth = 0;  // for allocate_slots() to say
  const auto offset = segment_.layout().rings_offset + shm::kRingBytes * link.channel;
  if (const auto error = shm::allocate(descriptor_, offset, shm::kRingBytes)) {
    throw std::system_error(error, "allocating a queue");
  }
  shm::make_resident(mapping_, offset, shm::kRingBytes, memory_->residence());
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
  const std::uint64_t added = wanted - allocated_slots_;
  shm::make_resident(
      mapping_, layout.headers_offset + sizeof(shm::SlotHeader) * std::size_t{allocated_slots_},
      sizeof(shm::SlotHeader) * added, memory_->residence());
  shm::make_resident(mapping_, layout.payload_offset + layout.stride * allocated_slots_,
                     layout.stride * added, memory_->residence());
  allocated_slots_ = wanted;
}

// For a link that found all channels in use when it came.
void OutputCore::connect_waiting(InputLink& link) noexcept {
  try {
    assign_channel(link);
    allocate_slots();
  } catch (const std::exception&) {  // no memory: it stays unconnected
    link.connected = false;
    link.refused = true;
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
  decisions_.reserve(view->links.size());
  for (const InputLink& link : view->links) {
    Destination destination;
    for (const Destination& old : destinations_) {
      if (old.peer == link.peer.get()) destination = old;
    }
    destination.peer = link.peer.get();
    destination.refused = link.refused;
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
  bound_epoch_ = UINT64_MAX;
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

bool OutputCore::rules_are_bound() const noexcept {
  return memory_->tables().epoch() == bound_epoch_ && memory_->pages().changes() == bound_pages_;
}

// Again where seven models were loaded meanwhile, for T is used before a decision checks the table.
void OutputCore::bind_rules() noexcept {
  for (int tries = 0; tries <= kMaxTableRetries; ++tries) {
    bound_pages_ = memory_->pages().changes();
    snapshot_ = memory_->tables().snapshot();
    bound_epoch_ = snapshot_.epoch;
    timeout_ = snapshot_.table.timeout(source_);
    bind_decisions();
    if (memory_->tables().is_whole(snapshot_)) return;
  }
}

void OutputCore::bind_decisions() noexcept {
  decisions_.clear();
  std::size_t reads = 0;
  for (Destination& destination : destinations_) {
    if (!destination.joined && !destination.refused) continue;
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
