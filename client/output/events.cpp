#include "client/output/events.hpp"

#include <fcntl.h>

#include <algorithm>
#include <bit>
#include <stdexcept>
#include <system_error>

#include "shm/limits.hpp"

namespace arbiter::detail {
namespace {

// The most memory that samples may take up for the sake of taps.
constexpr std::uint64_t kMaxTapMemory = std::uint64_t{64} << 20;
// One that is kept and one that is held: with fewer there is nothing to be read.
constexpr std::uint32_t kMinTapSlots = 2;

// What is kept for root and the daemon's own user: one in so many.
constexpr std::uint32_t kReserve = 8;

// Of something that taps have: how much all have together, one user, and the privileged.
struct Taken {
  std::uint32_t all = 0;
  std::uint32_t users = 0;  // of one who is not privileged
  std::uint32_t privileged = 0;

  void add(const TapPeer& tap, uid_t user, std::uint32_t amount) noexcept {
    all += amount;
    if (tap.is_privileged) {
      privileged += amount;
    } else if (tap.user == user) {
      users += amount;
    }
  }
  // Whether the tap may have `amount` more, of a `total`.
  [[nodiscard]] bool allows(const TapPeer& tap, std::uint32_t total,
                            std::uint32_t amount) const noexcept {
    if (amount == 0) return true;
    const std::uint32_t reserve = total / kReserve;
    const std::uint32_t kept = tap.is_privileged ? 0 : reserve - std::min(reserve, privileged);
    const std::uint32_t gone = all + kept + amount;
    return gone <= total && (tap.is_privileged || users + amount <= total - gone);
  }
};

// In what a layout has beside the samples.
constexpr std::uint64_t kOverhead = std::uint64_t{16} << 20;

}  // namespace

std::uint32_t slots_for_taps(std::uint64_t stride, std::uint32_t slots_of_components) {
  const std::uint64_t used = stride * slots_of_components + kOverhead;
  const std::uint64_t left = used < shm::kMaxSegmentSize ? shm::kMaxSegmentSize - used : 0;
  const std::uint64_t slots =
      std::min({std::max<std::uint64_t>(kMaxTapMemory / stride, kMinTapSlots), left / stride,
                std::uint64_t{kMaxTapSlots}});
  return slots < kMinTapSlots ? 0 : static_cast<std::uint32_t>(slots);
}

EventMemory::EventMemory(const shm::EventShape& shape, shm::Residence residence)
    : descriptor_(shm::make_segment("arbiter-events", sizeof(shm::EventSegment))),
      mapping_(descriptor_, sizeof(shm::EventSegment), shm::Access::kReadWrite) {
  if (const auto error = shm::allocate(descriptor_, 0, sizeof(shm::EventSegment))) {
    throw std::system_error(error, "allocating the events of a port");
  }
  shm::make_resident(mapping_, 0, sizeof(shm::EventSegment), residence);
  segment().initialize(shape);
  shm::seal(descriptor_, shm::Seals::kOneWriter);
  bequest_.emplace(mapping_.data(), mapping_.size(), shm::Bequest::Kind::kPrivateZeros);
  shm::close_in_children(descriptor_);
  readable_ = shm::reopen(descriptor_, O_RDONLY);
  shm::close_in_children(readable_);
}

// Taps and holds are for all users: nobody may have more of them than is left for the others, as of
// what the daemon has (service/policy/shares.hpp), and an eighth is kept for root and the daemon's
// own user. Those two are bound by what there is alone.
void TapSeats::require_room(const TapPeer& peer, const std::string& port,
                            std::uint32_t may_be_held) const {
  Taken taps;
  Taken holds;
  for (const auto& [instance, seat] : seats_) {
    taps.add(*seat.peer, peer.user, 1);
    holds.add(*seat.peer, peer.user, seat.peer->max_held);
  }
  const auto share = [&](const Taken& taken) {
    if (peer.is_privileged) return std::string();
    return "; user " + std::to_string(peer.user) + " has " + std::to_string(taken.users) +
           " of them, and may have no more than is left for others";
  };
  if (!taps.allows(peer, shm::kMaxTaps, 1)) {
    throw std::runtime_error(port + " has " + std::to_string(taps.all) + " taps already, of " +
                             std::to_string(shm::kMaxTaps) + " (kMaxTaps)" + share(taps));
  }
  if (!holds.allows(peer, may_be_held, peer.max_held)) {
    throw std::runtime_error("the taps of " + port + " may hold " + std::to_string(may_be_held) +
                             " samples together, and hold " + std::to_string(holds.all) +
                             " already; this one wants " + std::to_string(peer.max_held) +
                             share(holds));
  }
}

const TapSeat& TapSeats::add(std::shared_ptr<const TapPeer> peer, const std::string& port,
                             std::uint32_t slots_reserved, shm::Residence residence) {
  const auto known = std::find_if(seats_.begin(), seats_.end(), [&](const auto& seat) {
    return seat.second.peer->identity == peer->identity;
  });
  if (known != seats_.end()) {
    TapSeat seat = std::move(known->second);
    seats_.erase(known);
    seat.is_doubtful = false;
    if (std::exchange(seat.has_ended, false)) seat.link = ++last_link_;
    return seats_[peer->instance] = std::move(seat);
  }
  if (slots_reserved < kMinTapSlots) {
    throw std::runtime_error("the samples of " + port + " are too large to be kept for a tap");
  }
  require_room(*peer, port, slots_reserved - slots_reserved / 2);
  std::uint32_t used = 0;
  for (const auto& [instance, seat] : seats_) used |= 1u << seat.place;
  if (memory_ == nullptr) {
    shm::EventShape shape;
    shape.kept = std::min(std::bit_floor(slots_reserved / 2), shm::kMaxKept);
    memory_ = std::make_shared<const EventMemory>(shape, residence);
  }
  TapSeat& seat = seats_[peer->instance];
  seat.peer = std::move(peer);
  seat.place = static_cast<std::uint32_t>(__builtin_ctz(~used));
  seat.link = ++last_link_;
  return seat;
}

bool TapSeats::remove(shm::PortInstance tap) { return seats_.erase(tap) != 0; }

void TapSeats::doubt_all() {
  for (auto& [instance, seat] : seats_) seat.is_doubtful = true;
}

void TapSeats::doubt(shm::PortInstance tap) {
  const auto found = seats_.find(tap);
  if (found != seats_.end()) found->second.is_doubtful = true;
}

void TapSeats::end(shm::PortInstance tap) {
  const auto found = seats_.find(tap);
  if (found != seats_.end()) found->second.has_ended = found->second.is_doubtful = true;
}

bool TapSeats::has_doubtful() const {
  return std::any_of(seats_.begin(), seats_.end(),
                     [](const auto& seat) { return seat.second.is_doubtful; });
}

// Its bell has no reader left.
bool TapSeats::remove_dead() {
  return std::erase_if(seats_, [](const auto& seat) {
           return seat.second.is_doubtful && seat.second.peer->ringer.is_deserted();
         }) != 0;
}

std::uint32_t TapSeats::slots() const {
  if (seats_.empty()) return 0;
  std::uint32_t slots = memory_->segment().header.shape.kept;
  for (const auto& [instance, seat] : seats_) slots += seat.peer->max_held;
  return slots;
}

TapView TapSeats::view(const shm::Destinations& destinations) {
  TapView view;
  if (memory_ == nullptr) return view;
  if (revision_ == 0 || destinations != listed_) {
    listed_ = destinations;
    shm::write_destinations(memory_->segment(), ++revision_, listed_);
  }
  view.memory = memory_;
  for (const auto& [instance, seat] : seats_) view.seats.push_back(seat);
  view.revision = revision_;
  return view;
}

void EventTeller::accept(const TapView& view, shm::EventRecord state, shm::SlotPool& pool) {
  if (view.memory == nullptr) return;
  if (!writer_) {
    memory_ = view.memory;
    writer_.emplace(memory_->segment());
  }
  const auto is_in = [](const std::vector<TapSeat>& seats, const TapSeat& one) {
    return std::any_of(seats.begin(), seats.end(),
                       [&](const TapSeat& seat) { return seat.link == one.link; });
  };
  for (const TapSeat& seat : seats_) {
    if (!is_in(view.seats, seat)) writer_->leave(seat.place);
  }
  const std::vector<TapSeat> before = std::exchange(seats_, view.seats);
  has_sleepers_ = std::any_of(seats_.begin(), seats_.end(),
                              [](const TapSeat& seat) { return seat.peer->sleeps; });
  is_on_ = !seats_.empty();
  refused_ = 0;  // of arrivals that nobody was told of
  if (!is_on_) writer_->keep_nothing([&](std::uint32_t slot) { pool.evict(slot); });
  if (std::exchange(revision_, view.revision) != view.revision && !before.empty() && is_on_) {
    shm::EventRecord change = state;
    change.kind = shm::EventKind::kDestinations;
    tell(change);
  }
  for (const TapSeat& seat : seats_) {
    if (is_in(before, seat)) continue;
    writer_->join(seat.place, seat.link);
    state.joined = seat.link;
    tell(state);
  }
}

void EventTeller::tell(shm::EventRecord& record, const shm::SampleOrigin& origin) noexcept {
  record.revision = revision_;
  writer_->write(record, origin);
  if (has_sleepers_) ring_sleepers();
}

// SYNC POINT: tap-waiting. Fence (f), between the event and our reading of wait words. Pairs with
// fence (g) of a tap about to wait: either it sees the event, or we see it wait. Relaxed is enough
// for the wait word: nothing is read by it.
void EventTeller::ring_sleepers() noexcept {
  shm::full_fence();
  for (TapSeat& seat : seats_) {
    if (!seat.peer->sleeps) continue;
    const std::uint64_t wait = seat.peer->segment->wait.load(std::memory_order_relaxed);
    if ((wait & 1) == 0 || wait == seat.rung) continue;
    seat.rung = wait;
    seat.peer->ringer.ring();
  }
}

}  // namespace arbiter::detail
