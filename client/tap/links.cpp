// The service thread's side of a tap: its segment, its sources, and the views that it offers.
#include <fcntl.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <system_error>

#include "client/tap/tap_core.hpp"
#include "client/types.hpp"

namespace arbiter::detail {

std::shared_ptr<const TapSource> map_tap_source(const wire::Received& announced,
                                                const shm::TypeInfo& own,
                                                shm::Residence residence) {
  auto source = std::make_shared<TapSource>();
  source->name = announced.message.name_view();
  source->output = map_output_peer(announced, own, residence);
  const shm::FileDescriptor& events = announced.descriptors[1];
  if (shm::checked_size(events, shm::Seals::kOneWriter) != sizeof(shm::EventSegment)) {
    throw std::runtime_error("the segment of events has another size");
  }
  if (shm::allocated_size(events) < sizeof(shm::EventSegment)) {
    throw std::runtime_error("the memory of events is not allocated");
  }
  source->identity = shm::identity_of(events);
  source->mapping = shm::Mapping(events, sizeof(shm::EventSegment), shm::Access::kReadOnly);
  source->events = source->mapping.as<const shm::EventSegment>();
  source->shape = source->events->checked_shape();
  source->place = announced.message.value;
  source->link = announced.message.link;
  if (!source->shape.is_sane() || source->place >= shm::kMaxTaps || source->link == 0) {
    throw std::runtime_error("the segment of events is not one of this version");
  }
  shm::make_resident(source->mapping, 0, sizeof(shm::EventSegment), residence);
  source->bequest.emplace(source->mapping.data(), source->mapping.size(),
                          shm::Bequest::Kind::kNothing);
  return source;
}

std::shared_ptr<const TapInput> map_tap_input(const wire::Received& announced,
                                              shm::Residence residence) {
  auto input = std::make_shared<TapInput>();
  input->instance = announced.message.peer;
  input->identity = shm::identity_of(announced.descriptors[0]);
  input->mapping = map_input_segment(announced.descriptors[0]);
  shm::make_resident(input->mapping, 0, sizeof(shm::InputSegment), residence);
  const auto& segment = *input->mapping.as<const shm::InputSegment>();
  input->watch.emplace(segment);
  for (std::size_t i = 0; i < shm::kLatencyBuckets; ++i) {
    input->latencies[i] = segment.header.latencies[i].load(std::memory_order_relaxed);
  }
  input->bequest.emplace(input->mapping.data(), input->mapping.size(),
                         shm::Bequest::Kind::kNothing);
  return input;
}

TapCore::TapCore(std::string name, const Type& type, const TapOptions& options,
                 std::shared_ptr<const ServiceBell> service_bell, shm::Residence residence)
    : name_(std::move(name)),
      options_(options),
      type_(as_info(type)),
      service_bell_(std::move(service_bell)),
      descriptor_(shm::make_segment("arbiter-tap", sizeof(shm::TapSegment))),
      mapping_(descriptor_, sizeof(shm::TapSegment), shm::Access::kReadWrite),
      segment_(mapping_.as<shm::TapSegment>()) {
  if (const auto error = shm::allocate(descriptor_, 0, sizeof(shm::TapSegment))) {
    throw std::system_error(error, "allocating a tap");
  }
  shm::make_resident(mapping_, 0, sizeof(shm::TapSegment), residence);
  segment_->magic = shm::TapSegment::kMagic;
  segment_->version = shm::TapSegment::kVersion;
  segment_->max_held = options.max_held;
  segment_->sleeps = options.may_wait ? 1 : 0;
  shm::seal(descriptor_, shm::Seals::kOneWriter);
  descriptor_ = shm::reopen(descriptor_, O_RDONLY);
  bequest_.emplace(mapping_.data(), mapping_.size(), shm::Bequest::Kind::kPrivateZeros);
  shm::close_in_children(descriptor_);
}

namespace {

// A daemon with memory of its own numbers ports from the beginning: one of its ports may have the
// number of one from before, of which not all is taken yet. They lie one behind the other.
template <class Link>
using Links = std::multimap<shm::PortInstance, Link>;

// The port that has that number now; null: there is none.
template <class Link>
Link* newest_of(Links<Link>& links, shm::PortInstance instance) {
  const auto [begin, end] = links.equal_range(instance);
  return begin == end ? nullptr : &std::prev(end)->second;
}

// No more than one from before, for a publisher may say again and again that it is another.
template <class Link>
Link& add_newest(Links<Link>& links, shm::PortInstance instance) {
  if (links.count(instance) > 1) links.erase(links.lower_bound(instance));
  return links.emplace(instance, Link{})->second;
}

}  // namespace

// A source that is known already goes on as it is: a daemon that has taken over tells of it again.
// An output port that another has in its place has ended, though no daemon was there to tell.
void TapCore::add_source(std::shared_ptr<const TapSource> source) {
  const auto instance = source->output->instance;
  TapSourceLink* known = newest_of(links_, instance);
  if (known != nullptr && !(known->source->identity == source->identity)) known = nullptr;
  if (known != nullptr && known->source->link == source->link && !known->gone) return;
  for (auto& [other, link] : links_) {
    if (&link != known && link.source->name == source->name) link.gone = true;
  }
  TapSourceLink& added = known == nullptr ? add_newest(links_, instance) : *known;
  added = {};
  added.source = std::move(source);
  offer_view();
}

void TapCore::lose_source(shm::PortInstance output, std::optional<shm::ActivityWord> activity) {
  TapSourceLink* const found = newest_of(links_, output);
  if (found == nullptr) return;
  found->gone = true;
  found->end = activity;
  offer_view();
}

void TapCore::lose_all_of(shm::SourceId source) {
  bool is_lost = false;
  for (auto& [output, link] : links_) {
    if (link.source->output->source != source || link.gone) continue;
    link.gone = is_lost = true;
    link.end.reset();
  }
  if (is_lost) offer_view();
}

void TapCore::add_input(std::shared_ptr<const TapInput> input) {
  const auto instance = input->instance;
  const TapInputLink* const known = newest_of(inputs_, instance);
  if (known != nullptr && known->input->identity == input->identity) return;
  for (auto& [other, link] : inputs_) link.gone = true;  // a port has one at a time
  add_newest(inputs_, instance).input = std::move(input);
  offer_view();
}

void TapCore::lose_input(shm::PortInstance input) {
  TapInputLink* const found = newest_of(inputs_, input);
  if (found == nullptr) return;
  found->gone = true;
  offer_view();
}

std::vector<std::shared_ptr<const OutputPeer>> TapCore::copied_from() {
  std::vector<std::shared_ptr<const OutputPeer>> found;
  for (auto& [instance, link] : links_) {
    const auto& output = link.source->output;
    const std::uint32_t copied = output->copied.load(std::memory_order_relaxed);
    if (std::exchange(link.copied, copied) != copied) found.push_back(output);
  }
  return found;
}

std::vector<std::string> TapCore::misbehaving() {
  std::vector<std::string> found;
  for (auto& [instance, link] : links_) {
    if (link.reported || !link.source->misbehaved.load(std::memory_order_relaxed)) continue;
    link.reported = true;
    found.push_back(link.source->name);
  }
  return found;
}

void TapCore::tidy() {
  handover_.collect();
  const auto sources = std::erase_if(links_, [](const auto& link) {
    const TapSource& source = *link.second.source;
    // What has yet to be said of it, misbehaving() says first.
    const bool is_said = link.second.reported || !source.misbehaved.load(std::memory_order_relaxed);
    return is_said && source.drained.load(std::memory_order_relaxed);
  });
  const auto inputs = std::erase_if(inputs_, [](const auto& link) {
    return link.second.input->drained.load(std::memory_order_relaxed);
  });
  if (sources + inputs != 0) offer_view();
}

void TapCore::offer_view() {
  auto view = std::make_unique<TapSourceView>();
  for (const auto& [instance, link] : links_) view->links.push_back(link);
  for (const auto& [instance, link] : inputs_) view->inputs.push_back(link);
  handover_.offer(std::move(view));
  // SYNC POINT: view-announced. As InputCore::offer_view().
  shm::full_fence();
  shm::ring_bell(bell_.write_end().get());
}

}  // namespace arbiter::detail
