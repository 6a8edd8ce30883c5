// A system's two workers, sending a sample back and forth.
#pragma once

#include <memory>
#include <string>

#include "bench/harness/rounds.hpp"
#include "bench/harness/worker.hpp"
#include "bench/peers/system.hpp"

namespace arbiter::bench {

struct PingPongOptions {
  int fifo_priority = 0;  // 0: not SCHED_FIFO
};

// Half a round trip is one way: publish, delivery and take; each sample is a round trip's half.
class PingPong {
 public:
  // Both ends are connected when it returns. Throws where the system cannot be had.
  PingPong(System& system, const Exchange& exchange, const PingPongOptions& options = {});

  [[nodiscard]] Histogram round(double seconds);

 private:
  void exchange(std::uint64_t times);

  std::unique_ptr<Session> session_;
  Worker responder_;
  Worker initiator_;
  double exchange_ns_ = 0;
};

// The systems that can do such an exchange, each set up and ready for its rounds; those that could
// not be had are in `absent`.
std::vector<Contender> ping_pongs(const Systems& systems, const Exchange& exchange,
                                  std::vector<Result>& absent, const PingPongOptions& options = {});

}  // namespace arbiter::bench
