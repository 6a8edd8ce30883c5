// The service thread's side of an input port: its segment, its peers, and the views that it offers.
#include <fcntl.h>

#include <algorithm>
#include <system_error>

#include "client/input/input_core.hpp"
#include "client/input/predecessors.hpp"
#include "client/types.hpp"
#include "shm/assertion.hpp"

namespace arbiter::detail {

InputCore::InputCore(std::string name, const Type& type, const InputPortOptions& options,
                     std::shared_ptr<SharedMemory> memory)
    : name_(std::move(name)),
      declared_type_(type),
      type_(as_info(type)),
      one_size_(type_.one_size()),
      max_held_(options.max_held),
      keep_(options.keep),
      memory_(std::move(memory)),
      descriptor_(shm::make_segment("arbiter-input", sizeof(shm::InputSegment))),
      mapping_(descriptor_, sizeof(shm::InputSegment), shm::Access::kReadWrite),
      segment_(mapping_.as<shm::InputSegment>()) {
  if (const auto error = shm::allocate(descriptor_, 0, sizeof(shm::InputSegment))) {
    throw std::system_error(error, "allocating an input port");
  }
  shm::make_resident(mapping_, 0, sizeof(shm::InputSegment), memory_->residence());
  shm::InputHeader& header = segment_->header;
  header.magic = shm::InputHeader::kMagic;
  header.version = shm::InputHeader::kVersion;
  header.depth = options.depth;
  header.max_held = options.max_held;
  header.keep = options.keep ? 1 : 0;
  header.refuse_new = options.when_full == WhenFull::refuse_new ? 1 : 0;
  header.type = type_;
  shm::seal(descriptor_, shm::Seals::kOneWriter);
  descriptor_ = shm::reopen(descriptor_, O_RDONLY);  // for others: the daemon passes it on as it is
  bequest_.emplace(mapping_.data(), mapping_.size(), shm::Bequest::Kind::kPrivateZeros);
  shm::close_in_children(descriptor_);
}

InputCore::~InputCore() {
  ARBITER_ASSERT(held_ == 0, "an input port ends while its samples are held");
  for (const auto& hold : segment_->header.holds) {
    ARBITER_ASSERT(hold.load(std::memory_order_relaxed) == 0, "a hold is left of no sample");
  }
  ARBITER_ASSERT(lingering_.empty(), "a publisher is kept of which nothing is held");
}

void InputCore::bind(shm::PortInstance instance, shm::PortId port) {
  instance_ = instance;
  port_ = port;
}

void InputCore::add_peer(std::shared_ptr<const OutputPeer> peer) {
  const auto instance = peer->instance;
  const std::uint64_t link = peer->link;
  links_[instance] = {std::move(peer), false};
  refused_.erase(instance);
  offer_view();
  take_up(link);
}

// From here on a publisher that waits for it may begin its queue. Who finds a sample in another
// queue that was published after one in this finds the view that has this one offered, too. Relaxed
// is enough: the fence of offer_view() stands between the offer and this store, and the publisher's
// fence (a) between its look and its first sample.
void InputCore::take_up(std::uint64_t link) noexcept {
  shm::Atomic<std::uint64_t>& newest = segment_->header.newest_link;
  newest.store(std::max(link, newest.load(std::memory_order_relaxed)), std::memory_order_relaxed);
}

std::shared_ptr<const OutputPeer> InputCore::peer(shm::PortInstance instance) const {
  const auto found = links_.find(instance);
  return found == links_.end() ? nullptr : found->second.peer;
}

std::vector<std::shared_ptr<const OutputPeer>> InputCore::copied_from() {
  std::vector<std::shared_ptr<const OutputPeer>> found;
  for (auto& [instance, link] : links_) {
    const std::uint32_t copied = link.peer->copied.load(std::memory_order_relaxed);
    if (std::exchange(link.copied, copied) != copied) found.push_back(link.peer);
  }
  return found;
}

void InputCore::lose_peer(shm::PortInstance peer) {
  const auto found = links_.find(peer);
  if (found != links_.end()) found->second.gone = true;
  if (refused_.erase(peer) != 0 || found != links_.end()) offer_view();
}

void InputCore::disconnect_peer(shm::PortInstance peer) {
  if (links_.erase(peer) + refused_.erase(peer) != 0) offer_view();
}

void InputCore::refuse_peer(shm::PortInstance peer, shm::SourceId source) {
  links_.erase(peer);
  refused_[peer] = source;
  offer_view();
}

std::vector<HeldLink> InputCore::held_links() const {
  std::vector<HeldLink> held;
  for (const auto& [peer, link] : links_) {
    if (!link.gone) held.push_back({peer, link.peer->link});
  }
  for (const auto& [peer, source] : refused_) held.push_back({peer, 0});
  return held;
}

void InputCore::tidy() {
  handover_.collect();
  const bool drained = std::any_of(links_.begin(), links_.end(), [](const auto& link) {
    return link.second.peer->drained.load(std::memory_order_relaxed);
  });
  if (drained || !spent_predecessors(links_, segment_->header.depth).empty()) offer_view();
}

bool InputCore::has_predecessors() const noexcept {
  return std::any_of(links_.begin(), links_.end(),
                     [](const auto& link) { return link.second.gone; });
}

std::vector<shm::PortInstance> InputCore::misbehaving() {
  std::vector<shm::PortInstance> found;
  for (auto& [instance, link] : links_) {
    if (link.reported || !link.peer->misbehaved.load(std::memory_order_relaxed)) continue;
    link.reported = true;
    found.push_back(instance);
  }
  return found;
}

// Leaves out those of whom nothing can be taken any more. Whoever knows of one counts what is lost
// with it: the port's thread, if it has accepted a view that had it, or else we. Which of the two
// is sure once the next view has been offered, for then it is seen whether the last one was
// accepted.
void InputCore::offer_view() {
  std::erase_if(links_, [](const auto& link) {
    return link.second.peer->drained.load(std::memory_order_relaxed);
  });
  std::vector<OutputLink> spent;
  for (const shm::PortInstance peer : spent_predecessors(links_, segment_->header.depth)) {
    spent.push_back(std::move(links_.extract(peer).mapped()));
  }
  const bool was_accepted = offer_links();
  const std::uint64_t before = let_go_;
  for (const OutputLink& link : spent) {
    const bool is_known = link.known || (link.offered && was_accepted);
    if (!is_known) let_go_ += accepted_on(*link.peer);
  }
  if (let_go_ != before) offer_links();  // to say so
  // SYNC POINT: view-announced. Between our offer and our ring; pairs with fence (d) of the port's
  // thread: having heard the ring, it sees the offer at its next last look, whatever the pipe
  // orders.
  shm::full_fence();
  // A receiver that waits must look again: a publisher may have delivered to it already.
  shm::ring_bell(bell_.write_end().get());
}

// True: the last view had been accepted.
bool InputCore::offer_links() {
  auto view = std::make_unique<InputView>();
  for (const auto& [peer, link] : links_) view->links.push_back(link);
  for (const auto& [peer, source] : refused_) view->refused.push_back(source);
  view->let_go = let_go_;
  const bool was_accepted = handover_.offer(std::move(view));
  for (auto& [peer, link] : links_) {
    link.known = link.known || (link.offered && was_accepted);
    link.offered = true;
  }
  return was_accepted;
}

}  // namespace arbiter::detail
