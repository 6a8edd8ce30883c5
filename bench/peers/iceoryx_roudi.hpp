// iceoryx's daemon, RouDi, in a process of the benchmark's own.
#pragma once

#include <memory>

#include "bench/harness/worker.hpp"

namespace arbiter::bench {

class IceoryxRoudi {
 public:
  // The one that runs, or a new one; it ends with the last that holds it. Throws where there cannot
  // be one: iceoryx allows one on a machine. A worker that talks to it names its runtime with
  // Exchange::unique at the beginning: what it leaves behind is found by that.
  static std::shared_ptr<IceoryxRoudi> share();

 private:
  IceoryxRoudi();

  Worker worker_;
};

// For a worker: no log but errors.
void quieten_iceoryx();

}  // namespace arbiter::bench
