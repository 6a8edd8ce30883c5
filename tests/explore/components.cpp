#include "tests/explore/components.hpp"

#include <algorithm>
#include <cstring>
#include <numeric>

#include "client/peers.hpp"

namespace arbiter::explore {
namespace {

Type sample_type() { return Type::untyped(sizeof(std::uint64_t)); }

}  // namespace

Outcome Output::publish() {
  const std::uint64_t sample = ++published;
  const Outcome outcome = core->publish_copy(&sample, sizeof sample, shm::monotonic_now());
  delivered += outcome.delivered;
  discarded += outcome.discarded;
  refused += outcome.refused;
  require(counters().no_slot.load(std::memory_order_relaxed) == 0, "no slot was free");
  return outcome;
}

Outcome Output::publish_known_to(const Input& own) {
  struct Bytes {
    std::byte* to;
    std::uint64_t sample;
  } bytes{nullptr, ++published};
  const detail::LoanedSlot loan = core->loan(sizeof bytes.sample);
  require(loan.data != nullptr, "no slot was free");
  bytes.to = loan.data;
  const auto write = [](void* called) noexcept {
    const auto* const late = static_cast<const Bytes*>(called);
    if (Explorer* explorer = Explorer::current()) explorer->write_plain(late->to);
    std::memcpy(late->to, &late->sample, sizeof late->sample);
  };
  const Published outcome =
      core->publish_late_bytes({own.core.get(), write, &bytes}, own.core->instance(), shm::kForever,
                               loan.slot, sizeof bytes.sample, shm::monotonic_now());
  delivered += outcome.outcome.delivered;
  discarded += outcome.outcome.discarded;
  return outcome.outcome;
}

const shm::OutputCounters& Output::counters() const {
  return mapping.as<const shm::OutputHeader>()->counters;
}

void Input::read_again(const detail::HeldSample& sample) const {
  if (Explorer* explorer = Explorer::current()) explorer->read_plain(sample.data);
  std::uint64_t which = 0;
  std::memcpy(&which, sample.data, sizeof which);
  require(which == sample.sequence, "a sample was torn or replaced");
}

void Input::note(const detail::HeldSample& sample) {
  read_again(sample);
  require(sample.sequence > last[sample.source], "a sample came twice, or late");
  last[sample.source] = sample.sequence;
  last_stamp = sample.stamp_ns;
  ++taken[sample.source];
}

detail::HeldSample Input::hold() {
  const detail::HeldSample sample = core->take();
  if (sample.data != nullptr) note(sample);
  return sample;
}

bool Input::take() {
  const detail::HeldSample sample = hold();
  if (sample.data == nullptr) return false;
  core->give_back(sample.hold);
  return true;
}

bool Input::take_unread() {
  const detail::HeldSample sample = core->take();
  if (sample.data == nullptr) return false;
  core->give_back(sample.hold);
  return true;
}

detail::Waited Input::wait(shm::Nanoseconds timeout) {
  detail::HeldSample sample;
  const detail::Waited waited = core->wait(timeout, sample);
  if (waited == detail::Waited::kSample) {
    note(sample);
    core->give_back(sample.hold);
  }
  return waited;
}

const shm::InputCounters& Input::counters() const {
  return mapping.as<const shm::InputSegment>()->header.counters;
}

std::uint64_t Input::taken_of_all() const {
  return std::accumulate(std::begin(taken), std::end(taken), std::uint64_t{0});
}

// Each event once and in order; a sample is as it was published.
bool Watcher::note(const detail::TapEventData& event) {
  lost += event.lost;
  const auto kind = static_cast<shm::EventKind>(event.kind);
  if (kind != shm::EventKind::kSample) return true;
  if (event.data != nullptr) {
    if (Explorer* explorer = Explorer::current()) explorer->read_plain(event.data);
    std::uint64_t which = 0;
    std::memcpy(&which, event.data, sizeof which);
    require(which == event.sequence, "a sample was torn or replaced");
    core->give_back(event.hold);
  }
  require(event.sequence > last, "an event came twice, or late");
  require(event.sequence == last + 1 || last == 0, "an event was passed over");
  last = event.sequence;
  accepted += event.accepted != 0 ? 1 : 0;
  ++seen;
  return true;
}

bool Watcher::take() {
  detail::TapEventData event;
  return core->take(event) && note(event);
}

bool Watcher::wait() {
  detail::TapEventData event;
  return core->wait(shm::kForever, event) && note(event);
}

namespace {

// A segment's descriptor is but a number here (kernel.cpp), which several may have.
shm::FileDescriptor alias(const shm::FileDescriptor& segment) {
  return shm::FileDescriptor(segment.get());
}

}  // namespace

Instance::Instance(const test::TableBuilder& model)
    : board_(shm::make_segment("board", sizeof(shm::Board))),
      board_mapping_(board_, sizeof(shm::Board), shm::Access::kReadWrite) {
  shm::TableWriter::initialize(*board_mapping_.as<shm::Board>());
  for (SourceId id = 0; id < kSources; ++id) {
    pages_.push_back(shm::make_segment("page", sizeof(shm::ActivityPage)));
    page_mappings_.emplace_back(pages_.back(), sizeof(shm::ActivityPage), shm::Access::kReadWrite);
    shm::TableWriter(*board_mapping_.as<shm::Board>()).give_page(id, 1);
  }
  prepare(model);
  put_in_force();
}

std::shared_ptr<detail::SharedMemory> Instance::make_memory() {
  auto memory = std::make_shared<detail::SharedMemory>(
      alias(board_), shm::FileDescriptor(), std::make_shared<const detail::ServiceBell>());
  for (SourceId id = 0; id < kSources; ++id) {
    memory->add_page(id, 1, std::string(1, static_cast<char>('A' + id)), alias(pages_[id]));
  }
  return memory;
}

std::unique_ptr<Output> Instance::make_output(std::uint32_t slots, std::uint32_t max_loans) {
  auto output = std::make_unique<Output>();
  output->memory = make_memory();
  OutputPortOptions options;
  options.max_loans = max_loans;  // 0: publish() copies; so there is not one slot to spare
  options.max_memory = shm::kCacheLine * std::size_t{slots == 0 ? 64 : slots};
  output->core =
      std::make_unique<detail::OutputCore>("output", sample_type(), options, output->memory);
  const shm::FileDescriptor& segment = output->core->segment_descriptor();
  output->mapping = shm::Mapping(segment, shm::checked_size(segment, shm::Seals::kOneWriter),
                                 shm::Access::kReadOnly);
  return output;
}

void Instance::bind(Output& output, SourceId source) {
  output.core->bind(next_instance_++, source, alias(pages_[source]));
}

std::unique_ptr<Input> Instance::make_input(shm::PortId port, const InputPortOptions& options) {
  auto input = std::make_unique<Input>();
  input->memory = make_memory();
  input->core = std::make_unique<detail::InputCore>("input", sample_type(), options, input->memory);
  input->core->bind(next_instance_++, port);
  input->port = port;
  input->mapping = shm::Mapping(input->core->segment_descriptor(), sizeof(shm::InputSegment),
                                shm::Access::kReadOnly);
  return input;
}

// Descriptors that the message carries, lent for the time of the call.
void Instance::tell_output(Output& output, const Input& input, std::uint64_t link) {
  wire::Received received;
  received.message.peer = input.core->instance();
  received.message.id = input.port;
  if (link != 0) received.message.flags = wire::kIsConnected;
  received.descriptors[0] = shm::FileDescriptor(input.core->segment_descriptor().get());
  received.descriptors[1] = shm::FileDescriptor(input.core->bell().write_end().get());
  output.core->add_peer(detail::map_input_peer(received, output.core->type()), link);
  for (auto& lent : received.descriptors) static_cast<void>(lent.release());
}

void Instance::tell_input(Input& input, const Output& output, std::uint64_t link) {
  wire::Received received;
  received.message.peer = output.core->instance();
  received.message.id = output.core->source();
  received.message.link = link;
  received.descriptors[0] = shm::FileDescriptor(output.core->segment_descriptor().get());
  input.core->add_peer(detail::map_output_peer(received, input.core->type()));
  for (auto& lent : received.descriptors) static_cast<void>(lent.release());
}

void Instance::tell_tap(Output& output, Watcher& watcher) {
  tell_watcher(output, watcher, tell_tapped(output, watcher));
}

detail::OutputCore::TapEntry Instance::tell_tapped(Output& output, const Watcher& watcher) {
  wire::Received received;
  received.message.peer = watcher.core->instance();
  received.descriptors[0] = shm::FileDescriptor(watcher.core->segment_descriptor().get());
  received.descriptors[1] = shm::FileDescriptor(watcher.core->bell().write_end().get());
  auto entry = output.core->add_tap(detail::map_tap_peer(received, shm::Residence::kMapped));
  for (auto& lent : received.descriptors) static_cast<void>(lent.release());
  return entry;
}

void Instance::tell_watcher(const Output& output, Watcher& watcher,
                            const detail::OutputCore::TapEntry& entry) {
  wire::Received received;
  received.message.peer = output.core->instance();
  received.message.id = output.core->source();
  received.message.link = entry.link;
  received.message.value = entry.place;
  received.descriptors[0] = shm::FileDescriptor(output.core->segment_descriptor().get());
  received.descriptors[1] = shm::FileDescriptor(entry.memory->readable().get());
  watcher.core->add_source(
      detail::map_tap_source(received, watcher.core->type(), shm::Residence::kMapped));
  for (auto& lent : received.descriptors) static_cast<void>(lent.release());
}

void Instance::connect(Output& output, Input& input) {
  const std::uint64_t link = next_link_++;
  tell_output(output, input, link);
  tell_input(input, output, link);
}

std::unique_ptr<Watcher> Instance::make_watcher(const TapOptions& options) {
  auto watcher = std::make_unique<Watcher>();
  watcher->core = std::make_unique<detail::TapCore>("tap", Type::untyped(0), options,
                                                    std::make_shared<const detail::ServiceBell>(),
                                                    shm::Residence::kMapped);
  watcher->core->bind(next_instance_++);
  return watcher;
}

void Instance::prepare(const test::TableBuilder& model) {
  shm::TableWriter(*board_mapping_.as<shm::Board>()).write(model.words(kSources, kPorts));
}
void Instance::put_in_force() { shm::TableWriter(*board_mapping_.as<shm::Board>()).put_in_force(); }

void Instance::make_next_page(SourceId) {
  const auto page = shm::make_segment("page", sizeof(shm::ActivityPage));
  next_page_ = page.get();
  next_mapping_ = shm::Mapping(page, sizeof(shm::ActivityPage), shm::Access::kReadWrite);
}
void Instance::show_next_page(SourceId source, detail::SharedMemory& memory) const {
  memory.add_page(source, 2, std::string(1, static_cast<char>('A' + source)),
                  shm::FileDescriptor(next_page_));
}
// The former owner keeps his mapping of the old page.
void Instance::change_page(SourceId source) {
  shm::Activity& next = next_mapping_.as<shm::ActivityPage>()->of(source);
  shm::TableWriter(*board_mapping_.as<shm::Board>()).change_page(source, activity(source), next);
  std::swap(page_mappings_[source], next_mapping_);
  pages_[source].reset();
  pages_[source] = shm::FileDescriptor(next_page_);
}

test::TableBuilder forever() {
  test::TableBuilder builder;
  for (SourceId id = 0; id < kSources; ++id) builder.timeout(id, shm::kForever);
  return builder;
}

InputPortOptions depth(std::uint32_t samples) {
  InputPortOptions options;
  options.depth = samples;
  return options;
}

Scene::Scene(const test::TableBuilder& model, const InputPortOptions& options,
             std::initializer_list<SourceId> connected)
    : instance(model), input(instance.make_input(kPort, options)) {
  for (SourceId id = 0; id < kSources; ++id) {
    outputs[id] = instance.make_output();
    instance.bind(*outputs[id], id);
    if (std::find(connected.begin(), connected.end(), id) != connected.end()) {
      instance.connect(*outputs[id], *input);
    } else {
      Instance::tell_output(*outputs[id], *input, 0);
    }
    outputs[id]->settle();
  }
  input->take();
}

void Scene::drain() {
  while (input->take()) {
  }
  std::uint64_t delivered = 0;
  for (const auto& output : outputs) delivered += output->delivered;
  const shm::InputCounters& counters = input->counters();
  const std::uint64_t done = input->taken_of_all() +
                             counters.dropped.load(std::memory_order_relaxed) +
                             counters.overtaken.load(std::memory_order_relaxed);
  require(delivered == done, "the account does not balance");
}

}  // namespace arbiter::explore
