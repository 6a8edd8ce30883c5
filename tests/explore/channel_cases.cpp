// A slot is never written while a receiver reads it (shm/channel.hpp, shm/slot_pool.hpp).
#include <functional>
#include <utility>

#include "tests/explore/case.hpp"
#include "tests/explore/scenario.hpp"

namespace arbiter::explore::channel_cases {
namespace {

constexpr shm::PortInstance kPublisher = 3, kReceiver = 4;

struct World {
  SegmentMemory memory;
  Publisher publisher;
  Receiver receiver;
  shm::Atomic<shm::Hold> hold{0};
  shm::Atomic<std::uint64_t> consumed{0};
  Plain<std::uint64_t> payloads[SegmentMemory::kSlots];

  // A queue with as few slots as may be, full, and with some samples overtaken already.
  void reset(std::uint32_t depth) {
    const shm::OutputSegment segment = memory.fresh();
    hold.store(0);
    publisher = {segment, shm::ChannelWriter(segment, 0), {}, kPublisher, payloads, &hold, 1, 0};
    publisher.pool.grow(depth + 1 + 1);  // queue, hold, loan
    publisher.writer.join(kReceiver, 1, depth);
    receiver = {shm::ChannelReader(segment, kPublisher, kReceiver), &hold, payloads, 0, 0};
    receiver.reader.join();
    for (std::uint32_t i = 0; i <= depth; ++i) publisher.publish();
  }
};

Explorer::Scenario publish_and_take(World& world, std::uint32_t depth, int publishes, int takes) {
  return [&world, depth, publishes, takes](Execution& execution) {
    world.reset(depth);
    execution.thread([&world, publishes] {
      for (int i = 0; i < publishes; ++i) world.publisher.publish();
    });
    execution.thread([&world, takes] {
      for (int i = 0; i < takes; ++i) world.receiver.take();
    });
    execution.finally([&world] {
      while (world.receiver.take()) {
      }
      require(world.receiver.last == world.publisher.published, "the newest sample is not there");
    });
  };
}

const Register kDepth1("TheQueueAloneKeepsItsPromiseWithDepth1", {5, 3},
                       [](const Explore& explore) {
                         World world;
                         explore(publish_and_take(world, 1, 2, 2));
                       });
const Register kDepth2("TheQueueAloneKeepsItsPromiseWithDepth2", {5, 3},
                       [](const Explore& explore) {
                         World world;
                         explore(publish_and_take(world, 2, 3, 2));
                       });

// A publisher that uses again at once what its receiver says it is done with.
Explorer::Scenario forget_and_reuse(World& world, std::uint32_t depth, int publishes, int takes) {
  return [&world, depth, publishes, takes](Execution& execution) {
    world.reset(depth);
    world.consumed.store(0);
    world.publisher.consumed = &world.consumed;
    world.receiver.consumed = &world.consumed;
    execution.thread([&world, publishes] {
      for (int i = 0; i < publishes; ++i) world.publisher.publish();
    });
    execution.thread([&world, takes] {
      for (int i = 0; i < takes; ++i) world.receiver.take_and_read_later();
    });
    execution.finally([&world] {
      while (world.receiver.take()) {
      }
      require(world.receiver.last == world.publisher.published, "the newest sample is not there");
      world.publisher.writer.leave([&](std::uint32_t slot) { world.publisher.pool.evict(slot); });
      world.publisher.pool.require_balance();
    });
  };
}

const Register kForgets1("WhatAReceiverIsDoneWithIsNotWrittenWhileItHoldsItWithDepth1", {4, 3},
                         [](const Explore& explore) {
                           World world;
                           explore(forget_and_reuse(world, 1, 2, 2));
                         });
const Register kForgets2("WhatAReceiverIsDoneWithIsNotWrittenWhileItHoldsItWithDepth2", {4, 3},
                         [](const Explore& explore) {
                           World world;
                           explore(forget_and_reuse(world, 2, 3, 2));
                         });

// A queue ends while its receiver takes hold, and its slots are used again at once.
Explorer::Scenario leave_and_reuse(World& world) {
  return [&world](Execution& execution) {
    world.reset(1);
    execution.thread([&world] {
      Publisher& publisher = world.publisher;
      publisher.writer.leave([&](std::uint32_t slot) { publisher.pool.evict(slot); });
      publisher.publish_fence();
      for (int i = 0; i < 2; ++i) {  // the loans never to be published
        publisher.write_sample();
      }
    });
    execution.thread([&world] { world.receiver.take(); });
  };
}

const Register kEnds("AQueueThatEndsTakesItsSamplesFromNobodyWhoHoldsOne", {4, 3},
                     [](const Explore& explore) {
                       World world;
                       explore(leave_and_reuse(world));
                     });

// A receiver whose ring lies where the other's did.
constexpr shm::PortInstance kNext = kReceiver + shm::kPageSize / shm::kCacheLine;

// A receiver looks for its queue while the publisher begins it, in a channel that another has used.
Explorer::Scenario join_a_used_channel(World& world) {
  return [&world](Execution& execution) {
    world.reset(1);
    Publisher& publisher = world.publisher;
    publisher.writer.leave([&](std::uint32_t slot) { publisher.pool.evict(slot); });
    world.receiver = {shm::ChannelReader(publisher.segment, kPublisher, kNext), &world.hold,
                      world.payloads, 0, publisher.published};
    execution.thread([&world] {
      Publisher& again = world.publisher;
      again.writer = shm::ChannelWriter(again.segment, 0);
      again.writer.join(kNext, 1, 2);
      again.publish();
      again.publish();
    });
    execution.thread([&world] {
      for (int i = 0; i < 2; ++i) {
        if (!world.receiver.reader.join()) continue;
        world.receiver.take();
        break;
      }
      require(world.receiver.lost == 0, "samples that were never there count as lost");
      require(world.receiver.reader.state() != shm::ChannelReader::State::kMisbehaved,
              "an honest publisher looks like another");
    });
  };
}

const Register kJoining("AReceiverFindsItsQueueWholeOrNotAtAll", {3, 2},
                        [](const Explore& explore) {
                          World world;
                          explore(join_a_used_channel(world));
                        });

// A queue ends, and the channel has another, before its receiver has heard of it.
Explorer::Scenario go_on_without(World& world, std::uint64_t taken,
                                 std::function<void(World&)> receive) {
  return [&world, taken, receive = std::move(receive)](Execution& execution) {
    world.reset(2);
    while (world.receiver.last != taken) world.receiver.take();
    execution.thread([&world] {
      Publisher& publisher = world.publisher;
      publisher.writer.leave([&](std::uint32_t slot) { publisher.pool.evict(slot); });
      publisher.writer = shm::ChannelWriter(publisher.segment, 0);
      publisher.writer.join(kNext, 1, 2);
      publisher.publish();
      publisher.publish();
    });
    execution.thread([&world, &receive] { receive(world); });
  };
}

// The next one's entries lie at other places than its own would.
void take_what_is_anothers(World& world) {
  for (int i = 0; i < 2; ++i) require(!world.receiver.take(), "a sample of another's was taken");
  require(world.receiver.reader.state() != shm::ChannelReader::State::kMisbehaved,
          "an honest publisher looks like another");
  require(world.receiver.lost == 1, "samples of another's count as lost");
}
const Register kAnothers("AReceiverThatIsLateTakesNoHonestPublisherForAnother", {3, 2},
                         [](const Explore& explore) {
                           World world;
                           explore(go_on_without(world, 3, take_what_is_anothers));
                         });

void count_what_waits(World& world) {
  const shm::ChannelReader& reader = world.receiver.reader;
  require(reader.backlog(reader.last_end()) == 1, "samples of another's count as dropped");
}
const Register kWaiting("WhatTheNextLinkAcceptsIsNotCountedForTheLast", {3, 2},
                        [](const Explore& explore) {
                          World world;
                          explore(go_on_without(world, 2, count_what_waits));
                        });

void count_after_a_look(World& world) {
  const std::uint64_t taken = world.receiver.take() ? 1 : 0;
  const shm::ChannelReader& reader = world.receiver.reader;
  require(taken + reader.unread(reader.last_end()) == 1, "a sample is not counted, or twice");
}
const Register kLooking("WhatWaitedIsCountedThoughItsReceiverHasFoundTheQueueEnded", {3, 2},
                        [](const Explore& explore) {
                          World world;
                          explore(go_on_without(world, 2, count_after_a_look));
                        });

// Then the next one begins where this one did.
Explorer::Scenario go_on_without_an_empty_one(World& world) {
  return [&world](Execution& execution) {
    world.reset(2);
    const auto begin_queue = [&world](shm::PortInstance receiver) {
      Publisher& publisher = world.publisher;
      publisher.writer.leave([&](std::uint32_t slot) { publisher.pool.evict(slot); });
      publisher.writer = shm::ChannelWriter(publisher.segment, 0);
      publisher.writer.join(receiver, 1, 2);
    };
    begin_queue(kReceiver);
    shm::ChannelReader& reader = world.receiver.reader;
    reader = shm::ChannelReader(world.publisher.segment, kPublisher, kReceiver);
    reader.join();
    execution.thread([&world, begin_queue] {
      begin_queue(kNext);
      world.publisher.publish();
      world.publisher.publish();
    });
    execution.thread([&reader] {
      require(reader.unread(reader.last_end()) == 0, "samples of another's count as lost");
    });
  };
}
const Register kEmpty("OfAQueueThatNothingCameToNothingIsCounted", {3, 2},
                      [](const Explore& explore) {
                        World world;
                        explore(go_on_without_an_empty_one(world));
                      });

}  // namespace
}  // namespace arbiter::explore::channel_cases
