// What carries samples from one process to another: Arbiter, what one would use instead of it, and
// what the machine does at best. Each in a file of its own behind this interface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "bench/harness/report.hpp"

namespace arbiter::bench {

enum class Waiting { kSpinning, kBlocking };
enum class Side { kInitiator, kResponder };

// A sample goes from the initiator to the responder, and one comes back.
struct Exchange {
  Waiting waiting = Waiting::kSpinning;
  std::size_t bytes = 64;  // of a sample, at least 8
  std::string unique;      // part of whatever names a system needs: no other session has it
};

// A worker's own end. Samples begin with a number; the rest is neither written nor read where the
// system does not need it: what is measured is the system, not memset().
class Endpoint {
 public:
  Endpoint() = default;
  Endpoint(const Endpoint&) = delete;
  Endpoint& operator=(const Endpoint&) = delete;
  virtual ~Endpoint() = default;

  virtual void send(std::uint64_t number) = 0;
  // Waits for the next sample, in the way that the exchange says, and returns its number. Gives up,
  // by a BenchError, only after seconds.
  virtual std::uint64_t receive() = 0;
};

// One exchange, set up. Made in the benchmark's own process before the workers are, so that they
// inherit what it has: pipes, shared memory. It must not start threads there.
class Session {
 public:
  Session() = default;
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  virtual ~Session() = default;

  // In a worker; both do so at the same time. When both have returned, samples flow.
  virtual std::unique_ptr<Endpoint> open(Side side) = 0;
};

class System {
 public:
  System() = default;
  System(const System&) = delete;
  System& operator=(const System&) = delete;
  virtual ~System() = default;

  [[nodiscard]] virtual std::string name() const = 0;
  [[nodiscard]] virtual Role role() const = 0;
  [[nodiscard]] virtual bool can(const Exchange& exchange) const = 0;
  // Throws where the system is not to be had on this machine; the report then says why.
  virtual std::unique_ptr<Session> prepare(const Exchange& exchange) = 0;
};

using Systems = std::vector<std::unique_ptr<System>>;

}  // namespace arbiter::bench
