// What take() costs its caller where a sample waits, beside what it must cost: the cache lines that
// the publisher's core has written.
#include <array>
#include <atomic>
#include <memory>

#include "bench/harness/cpu.hpp"
#include "bench/harness/robot.hpp"
#include "bench/harness/shared.hpp"
#include "bench/measures/measures.hpp"
#include "bench/peers/spin.hpp"
#include "shm/limits.hpp"

namespace arbiter::bench {
namespace {

constexpr int kBatch = 8;  // a queue's depth

using Payload = std::array<std::uint64_t, 8>;

// One side writes a batch when the other asks for it.
struct Turn {
  alignas(shm::kCacheLine) std::atomic<std::uint64_t> asked{0};
  alignas(shm::kCacheLine) std::atomic<std::uint64_t> written{0};
};

// `write_batch` on one core, and `read_batch`, which is timed, on the other.
template <class MakeWriter, class MakeReader>
Contender in_turns(const std::string& system, Role role, MakeWriter make_writer,
                   MakeReader make_reader) {
  auto turn = std::make_shared<Shared<Turn>>();
  auto writer = std::make_shared<Worker>(system + ", writer", [=](Conversation& with) {
    auto write_batch = make_writer();
    pin(1);
    with.say(1);
    Turn& turns = **turn;
    for (std::uint64_t batches = 0; with.hear_or_end(batches);) {
      for (; batches != 0; --batches) {
        const std::uint64_t next = turns.written.load(std::memory_order_relaxed) + 1;
        spin_until([&] { return turns.asked.load(std::memory_order_acquire) == next; });
        write_batch();
        turns.written.store(next, std::memory_order_release);
      }
    }
  });
  auto reader = std::make_shared<Worker>(system + ", reader", [=](Conversation& with) {
    auto read_batch = make_reader();
    pin(0);
    with.say(1);
    Turn& turns = **turn;
    for (std::uint64_t batches = 0; with.hear_or_end(batches);) {
      Histogram each;
      for (; batches != 0; --batches) {
        const std::uint64_t next = turns.asked.load(std::memory_order_relaxed) + 1;
        turns.asked.store(next, std::memory_order_release);
        spin_until([&] { return turns.written.load(std::memory_order_acquire) == next; });
        const std::int64_t before = now_ns();
        read_batch();
        each.add(static_cast<double>(now_ns() - before) / kBatch);
      }
      with.say(each);
    }
  });
  writer->hear();
  reader->hear();
  return {system, role, [writer, reader](double seconds) {
            const auto batches = static_cast<std::uint64_t>(seconds * 2e5);  // some 5 us each
            writer->say(batches);
            reader->say(batches);
            return reader->hear_histogram();
          }};
}

// What a take must read of a sample: where it is, what it is, and its first word.
struct Lines {
  struct alignas(shm::kCacheLine) Line {
    std::atomic<std::uint64_t> words[shm::kCacheLine / sizeof(std::uint64_t)];
  };
  Line entries;
  Line headers[kBatch];
  Line payloads[kBatch];
};

Contender cache_lines() {
  auto lines = std::make_shared<Shared<Lines>>();
  constexpr auto kRelaxed = std::memory_order_relaxed;
  return in_turns(
      "its cache lines alone", Role::kFloor,
      [=] {
        return [lines, count = std::uint64_t{0}]() mutable {
          for (std::size_t i = 0; i < kBatch; ++i) {
            (*lines)->payloads[i].words[0].store(++count, kRelaxed);
            for (int word = 0; word < 3; ++word) {
              (*lines)->headers[i].words[word].store(count, kRelaxed);
            }
            (*lines)->entries.words[i].store(i, std::memory_order_release);
          }
        };
      },
      [=] {
        return [lines] {
          for (const auto& entry : (*lines)->entries.words) {
            const std::uint64_t slot = entry.load(std::memory_order_acquire) % kBatch;
            for (int word = 0; word < 3; ++word) {
              keep((*lines)->headers[slot].words[word].load(kRelaxed));
            }
            keep((*lines)->payloads[slot].words[0].load(kRelaxed));
          }
        };
      });
}

Contender arbiter_take() {
  auto robot = std::make_shared<Robot>(model(behaviour("/out:o", "/in:i", 8)));
  return in_turns(
      "arbiter, 8 activities", Role::kOurs,
      [=] {
        auto node = std::make_shared<Node>(robot->node("publisher"));
        auto output = std::make_shared<OutputPort<Payload>>(node->output_port<Payload>("/out:o"));
        return [node, output] {
          for (int i = 0; i < kBatch; ++i) {
            auto loan = output->loan();
            if (!loan) throw BenchError("no memory for a sample");
            (**loan)[0] = 1;
            output->publish(std::move(*loan));
          }
        };
      },
      [=] {
        auto node = std::make_shared<Node>(robot->node("receiver"));
        auto input = std::make_shared<InputPort<Payload>>(node->input_port<Payload>("/in:i"));
        return [node, input] {
          for (int i = 0; i < kBatch; ++i) {
            const auto sample = input->take();
            if (!sample) throw BenchError("the sample is not there");
            keep((**sample)[0]);
          }
        };
      });
}

}  // namespace

Measure measure_hit(const Effort& effort) {
  Measure measure{"hit", "take() of a waiting sample",
                  "Eight samples of 64 B wait, written by another core just now; the mean cost of "
                  "taking one and reading its first word. Beside it, reading the three cache lines "
                  "that each of them must come by."};
  Case one{"8 samples wait"};
  std::vector<Contender> contenders;
  contenders.push_back(arbiter_take());
  contenders.push_back(cache_lines());
  one.results = run_rounds(std::move(contenders), effort.budget());
  measure.cases.push_back(std::move(one));
  return measure;
}

}  // namespace arbiter::bench
