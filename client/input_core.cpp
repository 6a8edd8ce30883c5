// The service thread's side of an input port, and the taking up of what it offers.
#include "client/input_core.hpp"

#include <fcntl.h>

#include <algorithm>
#include <system_error>

#include "client/count.hpp"
#include "client/predecessors.hpp"
#include "client/types.hpp"

namespace arbiter::detail {
namespace {

const shm::Atomic<std::uint64_t> nothing_seen{0};

}  // namespace

InputCore::InputCore(std::string name, const Type& type, const InputPortOptions& options,
                     std::shared_ptr<SharedMemory> memory)
    : name_(std::move(name)),
      declared_type_(type),
      type_(as_info(type)),
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

void InputCore::bind(shm::PortInstance instance, shm::PortId port) {
  instance_ = instance;
  port_ = port;
}

void InputCore::add_peer(std::shared_ptr<const OutputPeer> peer) {
  const auto instance = peer->instance;
  links_[instance] = {std::move(peer), false};
  refused_.erase(instance);
  offer_view();
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

// Port's thread.

void InputCore::accept_view() {
  std::unique_ptr<InputView> view = handover_.accept();
  if (view == nullptr) return;
  const auto link_of = [&](const Queue& queue) {
    return std::find_if(view->links.begin(), view->links.end(),
                        [&](const OutputLink& link) { return link.peer == queue.peer; });
  };
  for (Queue& queue : queues_) {
    const auto link = link_of(queue);
    if (link != view->links.end()) {
      queue.gone = link->gone;
    } else {
      retire_queue(queue, *view);
    }
  }
  std::erase_if(queues_, [](const Queue& queue) { return queue.lane == nullptr; });
  count(segment_->header.counters.overtaken,
        view->let_go - std::exchange(counted_let_go_, view->let_go));
  for (const OutputLink& link : view->links) {
    const bool known = std::any_of(queues_.begin(), queues_.end(),
                                   [&](const Queue& queue) { return queue.peer == link.peer; });
    if (known || link.peer->drained.load(std::memory_order_relaxed)) continue;
    Queue queue;
    queue.peer = link.peer;
    queue.gone = link.gone;
    queue.allocated_slots = link.peer->allocated_slots.load(std::memory_order_relaxed);
    queue.reader = shm::ChannelReader(link.peer->segment, link.peer->instance, link.peer->link);
    queue.lane = free_lane();
    if (queue.lane == nullptr) continue;
    queue.lane->source.store(link.peer->source, std::memory_order_relaxed);
    queue.lane->link.store(link.peer->link, std::memory_order_relaxed);
    queue.lane->consumed.store(0, std::memory_order_relaxed);
    queue.lane->taken.store(0, std::memory_order_relaxed);
    queue.lane->dropped.store(0, std::memory_order_relaxed);
    queue.lane->overtaken.store(0, std::memory_order_relaxed);
    // SYNC POINT: lane-given. Release, with the acquire in OutputCore::is_full().
    queue.lane->publisher.store(link.peer->instance, std::memory_order_release);
    queues_.push_back(std::move(queue));
  }
  // Nothing is known of them yet: no word says so.
  watches_.assign(queues_.size(), {&nothing_seen, 1});
  waiting_.clear();
  waiting_.reserve(queues_.size());
  handover_.retire(std::exchange(view_, std::move(view)));
  memory_->service_bell().ring();  // to dispose of the old one
  bound_epoch_ = UINT64_MAX;
}

shm::Lane* InputCore::free_lane() noexcept {
  for (shm::Lane& lane : segment_->lanes) {
    if (lane.publisher.load(std::memory_order_relaxed) == 0) return &lane;
  }
  return nullptr;
}

// What the queue still has is lost: its connection is gone; or its publisher is, and a later one of
// the same source has pushed all of it out.
void InputCore::retire_queue(Queue& queue, const InputView& next) {
  const bool is_succeeded =
      std::any_of(next.links.begin(), next.links.end(), [&](const OutputLink& link) {
        return link.peer->source == queue.peer->source &&
               link.peer->instance > queue.peer->instance;
      });
  shm::InputCounters& counters = segment_->header.counters;
  if (is_succeeded) {
    join(queue);
    count(counters.overtaken, queue.reader.left_behind());
  } else {
    count(counters.dropped, queue.reader.backlog(queue.reader.backlog_end()));
  }
  if (queue.peer->held != 0) {
    auto kept = std::make_unique<InputView>();
    kept->links.push_back({queue.peer, true});
    lingering_.push_back(std::move(kept));
  }
  queue.peer->drained.store(true, std::memory_order_relaxed);
  queue.lane->publisher.store(0, std::memory_order_relaxed);
  queue.lane = nullptr;
}

void InputCore::bind_rules() {
  bound_pages_ = memory_->pages().changes();
  snapshot_ = memory_->tables().snapshot();
  bound_epoch_ = snapshot_.epoch;
  const shm::TableView& table = snapshot_.table;
  rules_.clear();
  sources_.clear();
  const auto range = table.connections_to(port_);
  for (auto index = range.first; index != range.first + range.count; ++index) {
    rules_.push_back(table.rule(index));
    sources_.push_back(rules_.back().source);
  }
  bind_queues();
  const shm::WordList read = table.sources_read(port_);
  for (shm::Word i = 0; i < read.count && i < shm::kMaxSourcesPerPort; ++i) {
    sources_.push_back(read[i]);
  }
  std::sort(sources_.begin(), sources_.end());
  sources_.erase(std::unique(sources_.begin(), sources_.end()), sources_.end());
  picture_.resize(sources_.size());
  activities_.resize(sources_.size());
  std::transform(sources_.begin(), sources_.end(), activities_.begin(),
                 [&](shm::SourceId source) { return memory_->pages().find(source); });
}

void InputCore::bind_queues() {
  const auto rule_of = [&](const Queue& queue) {
    const auto found = std::find_if(rules_.begin(), rules_.end(), [&](const shm::Rule& rule) {
      return rule.source == queue.peer->source;
    });
    return found == rules_.end() ? shm::Rule{} : *found;
  };
  std::size_t reads = 0;
  for (const Queue& queue : queues_) reads += shm::BoundRule::reads_of(rule_of(queue));
  reads_.resize(std::max(reads_.size(), reads));
  shm::Read* next = reads_.data();
  for (Queue& queue : queues_) {
    const shm::Rule rule = rule_of(queue);
    queue.rule.bind(rule, memory_->pages(), next, false);
    next += shm::BoundRule::reads_of(rule);
  }
}

void InputCore::refresh() {
  if (handover_.has_offer()) accept_view();
  if (memory_->tables().epoch() != bound_epoch_ || memory_->pages().changes() != bound_pages_) {
    bind_rules();
  }
}

}  // namespace arbiter::detail
