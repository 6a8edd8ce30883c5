#include "tests/fuzz/segments/world.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

#include "client/peers.hpp"
#include "client/types.hpp"
#include "tests/fuzz/segments/guarded_mapping.hpp"
#include "tests/shm/table_builder.hpp"
#include "tests/support/segments.hpp"

namespace arbiter::fuzz {
namespace {

enum : std::uint32_t { kP, kH, kS, kSources };
enum : std::uint32_t { kR, kR2, kX, kPorts };

struct Sample {
  std::uint64_t number;
  std::uint64_t words;
  std::uint64_t filled[kSampleWords];
};

shm::TypeInfo type() {
  shm::TypeInfo type;
  type.set_name("Sample");
  type.size = sizeof(Sample);
  type.alignment = alignof(Sample);
  return type;
}

OutputPortOptions output_options() {
  OutputPortOptions options;
  options.max_loans = 1;
  options.max_memory = 64 << 10;
  return options;
}

std::unique_ptr<detail::ServiceBell> bell() { return std::make_unique<detail::ServiceBell>(); }

TapOptions tap_options() {
  TapOptions options;
  options.max_held = 2;
  return options;
}

InputPortOptions input_options(const Choices& choices, bool refuse) {
  InputPortOptions options;
  options.depth = choices.depth;
  options.max_held = 2;
  options.when_full = refuse ? refuse_new : drop_oldest;
  return options;
}

}  // namespace

void die(const std::string& what) {
  std::fprintf(stderr, "FAILED: %s\n", what.c_str());
  std::abort();
}

// The same for all worlds that choose alike.
const shm::FileDescriptor& World::board_for(const Choices& choices) {
  static const shm::FileDescriptor boards[]{make_board({.timeouts = false}),
                                            make_board({.timeouts = true})};
  return boards[choices.timeouts ? 1 : 0];
}

shm::FileDescriptor World::make_board(const Choices& choices) {
  auto board = shm::make_segment("board", sizeof(shm::Board));
  const shm::Mapping mapping(board, sizeof(shm::Board), shm::Access::kReadWrite);
  auto& content = *mapping.as<shm::Board>();
  shm::TableWriter::initialize(content);
  test::TableBuilder table;
  const shm::Nanoseconds timeout = choices.timeouts ? 1'000'000'000'000 : shm::kForever;
  for (std::uint32_t source = 0; source < kSources; ++source) table.timeout(source, timeout);
  table.conjunction(kP, kR, {}, {kS}).conjunction(kH, kR, {kS}, {});
  table.conjunction(kP, kR2, {}, {kH}).conjunction(kH, kR2, {}, {});
  table.conjunction(kP, kX, {}, {});
  shm::TableWriter writer(content);
  writer.write(table.words(kSources, kPorts));
  writer.put_in_force();
  for (std::uint32_t source = 0; source < kSources; ++source) writer.give_page(source, 1);
  shm::seal(board, shm::Seals::kFixedSize);
  return board;
}

shm::FileDescriptor World::make_page(bool hostile) {
  auto page = shm::make_segment("page", sizeof(shm::ActivityPage));
  shm::seal(page, shm::Seals::kFixedSize);
  if (hostile) declare_hostile(page.get());
  return page;
}

std::shared_ptr<detail::SharedMemory> World::make_memory() {
  auto memory = std::make_shared<detail::SharedMemory>(
      shm::duplicate(board_.get()), shm::FileDescriptor(), std::make_shared<detail::ServiceBell>());
  const char* const names[]{"/p", "/h", "/s"};
  for (std::uint32_t source = 0; source < kSources; ++source) {
    memory->add_page(source, 1, names[source], shm::duplicate(pages_[source].get()));
  }
  return memory;
}

World::World(const Choices& choices)
    : board_(board_for(choices)),
      pages_{make_page(false), make_page(true), make_page(false)},
      honest_(make_memory()),
      hostile_(make_memory()),
      p("/p", detail::as_type(type()), output_options(), honest_),
      s("/s", detail::as_type(type()), output_options(), honest_),
      h("/h", detail::as_type(type()), output_options(), hostile_),
      r("/r", detail::as_type(type()), input_options(choices, false), honest_),
      r2("/r2", detail::as_type(type()), input_options(choices, choices.refuse_new), honest_),
      x("/x", detail::as_type(type()), input_options(choices, choices.refuse_new), hostile_),
      t("/p", detail::as_type(type()), tap_options(), bell(), shm::Residence::kMapped),
      y("/p", detail::as_type(type()), tap_options(), bell(), shm::Residence::kMapped) {
  declare_hostile(h.segment_descriptor().get());
  declare_hostile(x.segment_descriptor().get());
  declare_hostile(y.segment_descriptor().get());
  p.bind(++last_instance_, kP, shm::duplicate(pages_[kP].get()));
  s.bind(++last_instance_, kS, shm::duplicate(pages_[kS].get()));
  h.bind(++last_instance_, kH, shm::duplicate(pages_[kH].get()));
  r.bind(++last_instance_, kR);
  r2.bind(++last_instance_, kR2);
  x.bind(++last_instance_, kX);
  connect(p, r);
  connect(p, r2);
  connect(p, x);
  connect(h, r);
  connect(h, r2);
}

void World::connect(detail::OutputCore& from, detail::InputCore& to) {
  const std::uint64_t link = ++last_link_;
  wire::Received to_output;
  to_output.message.peer = to.instance();
  to_output.message.id = &to == &r ? kR : &to == &r2 ? kR2 : kX;
  to_output.message.flags = wire::kIsConnected;
  to_output.descriptors[0] = shm::duplicate(to.segment_descriptor().get());
  to_output.descriptors[1] = shm::duplicate(to.bell().write_end().get());
  try {
    from.add_peer(detail::map_input_peer(to_output, type()), link);
  } catch (const std::runtime_error&) {  // others have taken up its max_memory
    return;
  }
  wire::Received to_input;
  to_input.message.peer = from.instance();
  to_input.message.id = from.source();
  to_input.message.link = link;
  to_input.descriptors[0] = shm::duplicate(from.segment_descriptor().get());
  to.add_peer(detail::map_output_peer(to_input, type()));
  show_growth(from);
}

void World::show_growth(const detail::OutputCore& of) const {
  for (const detail::InputCore* const each : {&r, &r2, &x}) {
    if (const auto grown = each->peer(of.instance())) {
      detail::survey(*grown);
    }
  }
}

void World::disconnect(detail::OutputCore& from, detail::InputCore& to) {
  from.disconnect_peer(to.instance());
  to.disconnect_peer(from.instance());
}

void World::watch() {
  t.bind(++last_instance_);
  y.bind(++last_instance_);
  watch(p, t);
  watch(h, t);
  watch(p, y);
  wire::Received to_tap;
  to_tap.message.peer = x.instance();
  to_tap.descriptors[0] = shm::duplicate(x.segment_descriptor().get());
  t.add_input(detail::map_tap_input(to_tap, shm::Residence::kMapped));
}

void World::watch(detail::OutputCore& from, detail::TapCore& by) {
  wire::Received to_output;
  to_output.message.peer = by.instance();
  to_output.descriptors[0] = shm::duplicate(by.segment_descriptor().get());
  to_output.descriptors[1] = shm::duplicate(by.bell().write_end().get());
  const auto entry = from.add_tap(detail::map_tap_peer(to_output, shm::Residence::kMapped));
  if (&from == &h) declare_hostile(entry.memory->readable().get());
  show_growth(from);
  wire::Received to_tap;
  to_tap.message.peer = from.instance();
  to_tap.message.id = from.source();
  to_tap.message.link = entry.link;
  to_tap.message.value = entry.place;
  to_tap.message.set_name(from.name());
  to_tap.descriptors[0] = shm::duplicate(from.segment_descriptor().get());
  to_tap.descriptors[1] = shm::duplicate(entry.memory->readable().get());
  by.add_source(detail::map_tap_source(to_tap, type(), shm::Residence::kMapped));
}

Outcome World::publish(detail::OutputCore& from, bool loan, std::uint32_t words) {
  Sample sample{};
  sample.number = &from == &p ? ++published_ : 0;
  sample.words = words % (kSampleWords + 1);
  for (std::uint64_t i = 0; i < sample.words; ++i) sample.filled[i] = sample.number * 31 + i;
  const std::size_t size = offsetof(Sample, filled) + 8 * sample.words;
  const shm::Nanoseconds now = shm::monotonic_now();
  if (!loan) return from.publish_copy(&sample, size, now);
  const detail::LoanedSlot slot = from.loan(size);
  if (slot.data == nullptr) {
    if (&from == &p) die("/p has no slot to lend");
    return {};
  }
  std::memcpy(slot.data, &sample, size);
  return from.publish_loan(slot.slot, size, now);
}

void World::require_account_of(const detail::InputCore& port, std::uint32_t id) const {
  const std::size_t size = shm::checked_size(p.segment_descriptor(), shm::Seals::kOneWriter);
  const shm::Mapping output(p.segment_descriptor(), size, shm::Access::kReadOnly);
  const auto layout = shm::OutputLayout::checked(*output.as<shm::OutputHeader>(), size);
  const std::uint64_t accepted = test::accepted_for(shm::OutputSegment(output.data(), layout), id);
  const shm::Mapping input(port.segment_descriptor(), sizeof(shm::InputSegment),
                           shm::Access::kReadOnly);
  for (const shm::Lane& lane : input.as<const shm::InputSegment>()->lanes) {
    if (lane.publisher.load() != p.instance()) continue;
    const std::uint64_t accounted = lane.taken.load() + lane.dropped.load() + lane.overtaken.load();
    const std::uint64_t consumed = lane.consumed.load();
    if (consumed != accounted) {
      die(port.name() + " has consumed " + std::to_string(consumed) + " of /p, accounts for " +
          std::to_string(accounted));
    }
    if (consumed > accepted || accepted - consumed > shm::kMaxDepth) {
      die(port.name() + " has consumed " + std::to_string(consumed) + " of " +
          std::to_string(accepted));
    }
    return;
  }
}

void World::require_accounts() {
  require_account_of(r, kR);
  require_account_of(r2, kR2);
  publish(p, true, 1);
  const shm::Mapping output(p.segment_descriptor(), sizeof(shm::OutputHeader),
                            shm::Access::kReadOnly);
  if (output.as<shm::OutputHeader>()->counters.no_slot.load() != 0) die("/p lacked a slot");
}

std::uint64_t World::require_whole(const detail::TapEventData& event) const {
  if (event.data == nullptr) return 0;
  detail::HeldSample sample;
  sample.source = event.context->source == "/p" ? kP : kH;
  sample.data = event.data;
  sample.size = event.size;
  // It may be a copy: nobody tells t that /p uses more of its segment.
  return require_content(sample);
}

std::uint64_t World::require_whole(const detail::HeldSample& held) const {
  if (held.source == kP && !is_mapped(held.data, held.size)) {
    die("a sample lies outside of any segment");
  }
  return require_content(held);
}

std::uint64_t World::require_content(const detail::HeldSample& held) const {
  if (held.source != kP && held.source != kH) die("a sample of nobody");
  // One of a hostile publisher may be a copy (client/input/copies.hpp): all of it can be read.
  if (held.source == kH) {
    read_ += static_cast<std::size_t>(std::count(held.data, held.data + held.size, std::byte{1}));
    return 0;  // says what it likes
  }
  Sample sample{};
  // A port with a type gives samples of its size, be it that less was written.
  if (held.size != sizeof sample) die("a sample of /p has another size");
  std::memcpy(&sample, held.data, held.size);
  bool whole = sample.number >= 1 && sample.number <= published_ && sample.words <= kSampleWords;
  for (std::uint64_t i = 0; whole && i < sample.words; ++i) {
    whole = sample.filled[i] == sample.number * 31 + i;
  }
  if (!whole) die("a sample of /p is torn");
  return sample.number;
}

}  // namespace arbiter::fuzz
