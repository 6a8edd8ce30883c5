// The service thread's side of an output port: its segment, its peers, the memory of its samples,
// and the views that it offers.
#include <fcntl.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "client/output/output_core.hpp"
#include "client/types.hpp"
#include "shm/assertion.hpp"

namespace arbiter::detail {
namespace {

// Beside the loans, one slot for publish() with a copy.
std::uint32_t slots_of_our_own(std::uint32_t max_loans) { return max_loans + 1; }

std::uint64_t stride_of(const shm::TypeInfo& type) {
  return shm::OutputLayout::plan(type, 1).stride;
}

std::uint32_t reserved_slots(const shm::TypeInfo& type, const OutputPortOptions& options) {
  const std::uint64_t fit = options.max_memory / stride_of(type);
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(fit, shm::kMaxSlots - kMaxTapSlots));
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
      memory_(std::move(memory)),
      slots_of_components_(reserved_slots(type_, options)),
      slots_of_taps_(slots_for_taps(stride_of(type_), slots_of_components_)),
      yields_(options.yields) {
  const auto layout = shm::OutputLayout::plan(type_, slots_of_components_ + slots_of_taps_);
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

OutputCore::~OutputCore() {
  ARBITER_ASSERT(loans_ == 0, "an output port ends while its loans are out");
  pool_.require_balance();
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

void OutputCore::refuse_peer(shm::PortInstance peer, shm::PortId port, std::string_view name) {
  InputLink& link = links_[peer];
  if (link.peer == nullptr) link.peer = unmapped_input_peer(peer, port, name);
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

OutputCore::TapEntry OutputCore::add_tap(std::shared_ptr<const TapPeer> tap) {
  const shm::PortInstance instance = tap->instance;
  const TapSeat seat = taps_.add(std::move(tap), name_, slots_of_taps_, memory_->residence());
  try {
    allocate_slots();
  } catch (...) {
    taps_.remove(instance);
    throw;
  }
  offer_view();
  return {seat.place, seat.link, taps_.memory()};
}

void OutputCore::remove_tap(shm::PortInstance tap) {
  if (taps_.remove(tap)) offer_view();
}

void OutputCore::tidy() {
  handover_.collect();
  if (taps_.has_doubtful() && taps_.remove_dead()) offer_view();
}

std::vector<shm::PortInstance> OutputCore::misbehaving() {
  std::vector<shm::PortInstance> found;
  for (const auto& [instance, link] : links_) {
    if (link.connected && link.peer->misbehaved.load(std::memory_order_relaxed)) {
      found.push_back(instance);
    }
  }
  for (const shm::PortInstance peer : found) {
    const InputPeer& known = *links_.at(peer).peer;
    refuse_peer(peer, known.port, known.name);
  }
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
// Taps have slots of their own beside: no queue is shorter for them.
void OutputCore::allocate_slots() {
  std::uint64_t needed = slots_of_our_own(max_loans_);
  for (const auto& [instance, link] : links_) {
    needed += link.peer->max_held + (link.channel == shm::kNone ? 0 : link.depth);
  }
  const std::uint64_t reserved = slots_of_components_;
  for (auto& [instance, link] : links_) {
    if (link.channel == shm::kNone || link.depth != 0) continue;
    if (needed >= reserved) {
      throw std::runtime_error("max_memory of " + name_ + " leaves no room for another input port");
    }
    link.depth =
        static_cast<std::uint32_t>(std::min<std::uint64_t>(link.peer->depth, reserved - needed));
    needed += link.depth;
  }
  const auto wanted = static_cast<std::uint32_t>(std::min(needed, reserved)) + taps_.slots();
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
void OutputCore::connect_waiting(InputLink& link) {
  try {
    assign_channel(link);
    allocate_slots();
  } catch (const std::exception& error) {  // no memory: it stays unconnected
    short_of_memory_.emplace_back(link.peer, error.what());
    memory_->service_bell().ring();  // for the node to say so
    link.connected = false;
    link.refused = true;
    link.channel = shm::kNone;
  }
}

// Which bit of a mask is whose. Connections that are refused are among them: of one source, all
// that a model makes are at most kMaxDestinations. What is more for a moment, because another model
// comes into force, has none.
shm::Destinations OutputCore::number_destinations() {
  shm::Destinations destinations;
  for (auto& [instance, link] : links_) {
    link.mask = 0;
    if (link.channel == shm::kNone && !link.refused) continue;
    if (destinations.size() == shm::kMaxDestinations) continue;
    link.mask = std::uint64_t{1} << destinations.size();
    destinations.push_back({link.peer->port, link.peer->name});
  }
  return destinations;
}

void OutputCore::offer_view() {
  auto view = std::make_unique<OutputView>();
  for (auto& [instance, link] : links_) {
    if (link.connected && link.channel == shm::kNone) connect_waiting(link);
  }
  view->taps = taps_.view(number_destinations());
  for (const auto& [instance, link] : links_) view->links.push_back(link);
  view->slots = allocated_slots_;
  handover_.offer(std::move(view));
}

}  // namespace arbiter::detail
