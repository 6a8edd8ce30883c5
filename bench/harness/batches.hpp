// Operations that are too short to be timed one by one: timed by the batch.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "bench/harness/cpu.hpp"
#include "bench/harness/rounds.hpp"
#include "bench/harness/worker.hpp"

namespace arbiter::bench {

// A contender that does one thing over and over in a worker of its own, alone on its processor.
// `make` is called there, once; what it returns is the operation. A sample is a batch's mean, the
// clock's reading between two batches included.
template <class Make>
Contender in_batches(const std::string& system, Role role, int batch, Make make) {
  auto worker = std::make_shared<Worker>(system, [=](Conversation& with) {
    auto operation = make();
    pin(0);
    with.say(1);
    for (std::uint64_t nanoseconds = 0; with.hear_or_end(nanoseconds);) {
      Histogram each;
      std::int64_t before = now_ns();
      const std::int64_t end = before + static_cast<std::int64_t>(nanoseconds);
      while (before < end) {
        for (int i = 0; i < batch; ++i) operation();
        const std::int64_t after = now_ns();
        each.add(static_cast<double>(after - before) / batch);
        before = after;
      }
      with.say(each);
    }
  });
  worker->hear();
  return {system, role, [worker](double seconds) {
            worker->say(static_cast<std::uint64_t>(seconds * 1e9));
            return worker->hear_histogram();
          }};
}

}  // namespace arbiter::bench
