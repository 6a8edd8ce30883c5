// The events of an output port, without the ports around them (shm/event_ring.hpp).
#include <sys/mman.h>

#include <new>

#include "shm/destination_list.hpp"
#include "shm/event_ring.hpp"
#include "tests/explore/case.hpp"
#include "tests/explore/scenario.hpp"

namespace arbiter::explore::event_cases {
namespace {

constexpr shm::PortInstance kPublisher = 3;
constexpr shm::EventShape kSmall{4, 1, 1};

// An event that says its own number in each of its words.
shm::EventRecord numbered(std::uint64_t number) {
  shm::EventRecord record;
  record.kind = shm::EventKind::kSignal;
  record.time = record.activity = static_cast<std::int64_t>(number);
  record.sample = record.size = record.generation = record.revision = number;
  record.masks = {number, number, number, number};
  return record;
}

bool is_of_one(const shm::EventRecord& record) {
  const auto number = static_cast<std::uint64_t>(record.time);
  return record.activity == record.time && record.sample == number && record.size == number &&
         record.generation == number && record.revision == number &&
         record.masks.accepted == number && record.masks.discarded == number &&
         record.masks.refused == number && record.masks.blind == number;
}

class Ring {
 public:
  Ring()
      : segment_(static_cast<shm::EventSegment*>(mmap(nullptr, sizeof(shm::EventSegment),
                                                      PROT_READ | PROT_WRITE,
                                                      MAP_PRIVATE | MAP_ANONYMOUS, -1, 0))) {}
  Ring(const Ring&) = delete;
  Ring& operator=(const Ring&) = delete;
  ~Ring() { munmap(segment_, sizeof *segment_); }

  // Zeroed as far as the scenarios use it.
  shm::EventSegment& fresh() {
    std::memset(static_cast<void*>(segment_), 0, offsetof(shm::EventSegment, lists));
    std::memset(static_cast<void*>(segment_->lists), 0, sizeof segment_->lists[0]);
    std::memset(static_cast<void*>(segment_->events), 0, kSmall.events * sizeof(shm::Event));
    segment_->initialize(kSmall);
    return *segment_;
  }

 private:
  shm::EventSegment* segment_;
};

struct Watcher {
  shm::EventReader reader;
  std::uint64_t last = 0;  // event that was read, or told to be lost, by its number
  std::uint64_t lost = 0;

  // Reads an event; false: there is none. Each event is read once, or counted as lost.
  bool read() {
    shm::EventRecord record;
    const std::uint64_t lost_before = lost;
    if (reader.read(record, lost) == shm::EventReader::Found::kNothing) {
      require(lost == lost_before, "events were lost without a word");
      return false;
    }
    require(is_of_one(record), "an event is made up of two");
    const auto number = static_cast<std::uint64_t>(record.time);
    const bool is_gap = lost != lost_before;
    require(number == last + (is_gap ? lost - lost_before : 1), "the account does not balance");
    last = number;
    return true;
  }
};

// A tap that is overtaken again and again.
void overtake(const Explore& explore) {
  Ring ring;
  Watcher watcher;
  explore([&](Execution& execution) {
    shm::EventSegment& segment = ring.fresh();
    auto writer = std::make_shared<shm::EventWriter>(segment);
    writer->join(0, 9);
    for (std::uint64_t i = 1; i <= 3; ++i) writer->write(numbered(i));
    watcher = {shm::EventReader(segment, kSmall, kPublisher, 0, 9), 0, 0};
    watcher.reader.join();
    execution.mortal_thread([writer] {
      for (int i = 0; i < 4; ++i) writer->write(numbered(writer->next()));
    });
    execution.thread([&watcher] {
      for (int i = 0; i < 2; ++i) watcher.read();
    });
    execution.finally([&watcher, writer] {
      while (watcher.read()) {
      }
      require(watcher.last == writer->next() - 1, "the newest event was not read");
    });
  });
}
const Register kOvertake("ATapThatIsOvertakenReadsNoEventThatIsMadeUpOfTwo", {2, 1, 1}, overtake);

// A tap joins where another was; it must not read what was written before its holds were heeded.
void join_after_another(const Explore& explore) {
  Ring ring;
  Watcher watcher;
  explore([&](Execution& execution) {
    shm::EventSegment& segment = ring.fresh();
    auto writer = std::make_shared<shm::EventWriter>(segment);
    writer->join(0, 8);
    writer->write(numbered(1));
    writer->leave(0);
    watcher = {shm::EventReader(segment, kSmall, kPublisher, 0, 9), 0, 0};
    execution.thread([writer] {
      writer->join(0, 9);
      writer->write(numbered(2));
    });
    execution.thread([&watcher] {
      if (watcher.reader.join()) {
        require(watcher.reader.next() == 2, "a tap reads from where another began");
      }
    });
  });
}
const Register kJoin("ATapReadsNothingOfBeforeItJoined", {4, 3}, join_after_another);

// The samples that are kept, with a pool that has not one slot to spare.
struct Kept {
  Ring ring;
  std::shared_ptr<shm::EventWriter> writer;
  shm::SlotPool pool;
  std::uint64_t published = 0;
  shm::Atomic<shm::Hold> hold{0};
  Plain<std::uint64_t> payloads[SegmentMemory::kSlots];
  shm::EventReader reader;
  std::uint64_t lost = 0;

  void reset() {
    shm::EventSegment& segment = ring.fresh();
    writer = std::make_shared<shm::EventWriter>(segment);
    pool = {};
    pool.grow(kSmall.kept + 1 + 1);  // kept, held, loan
    published = 0;
    hold.store(0);
    lost = 0;
    writer->join(0, 9);
    reader = shm::EventReader(segment, kSmall, kPublisher, 0, 9);
    reader.join();
    for (int i = 0; i < 2; ++i) publish();
  }
  // As OutputCore does it.
  void publish() {
    const std::uint32_t slot = pool.acquire(kPublisher, [&](auto&& each) {
      shm::full_fence();  // (b)
      each(&hold, 1);
    });
    require(slot != shm::kNoSlot, "no slot is free");
    payloads[slot].write(++published);
    pool.add_reference(slot);
    const shm::Entry entry = shm::make_entry(published, slot);
    const std::uint32_t evicted = writer->keep(entry);
    if (evicted != shm::kNoSlot) pool.evict(evicted);
    shm::EventRecord record = numbered(published);
    record.sample = entry;
    writer->write(record);
    pool.end_loan(slot);
  }
  void take() {
    shm::EventRecord record;
    if (reader.read(record, lost) != shm::EventReader::Found::kEvent) return;
    if (!reader.hold(record.sample, hold)) return;
    const std::uint64_t value = payloads[shm::slot_of(record.sample)].read();
    require(value == shm::sequence_of(record.sample), "a sample was torn or replaced");
    shm::ChannelReader::release(hold);
  }
};

void keep(const Explore& explore) {
  Kept world;
  explore([&](Execution& execution) {
    world.reset();
    execution.thread([&world] {
      for (int i = 0; i < 3; ++i) world.publish();
    });
    execution.mortal_thread([&world] {
      for (int i = 0; i < 3; ++i) world.take();
    });
  });
}
const Register kKeep("NoSampleIsWrittenWhileATapReadsIt", {2, 1, 1}, keep);

// A list of destinations that is overwritten while it is read.
void change_destinations(const Explore& explore) {
  Ring ring;
  explore([&](Execution& execution) {
    shm::EventSegment& segment = ring.fresh();
    shm::write_destinations(segment, 1, {{1, "/one:i"}});
    execution.thread([&segment] { shm::write_destinations(segment, 2, {{2, "/two:i"}}); });
    execution.thread([&segment] {
      shm::Destinations found;
      if (!shm::read_destinations(segment, kSmall, 1, found)) return;
      require(found == shm::Destinations{{1, "/one:i"}}, "a list is made up of two");
    });
  });
}
const Register kDestinations("AListOfDestinationsThatIsOverwrittenIsNeverTakenForWhole", {4, 3},
                             change_destinations);

}  // namespace
}  // namespace arbiter::explore::event_cases
