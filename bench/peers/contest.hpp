// Two sources that want one destination: an old winner, and its override. What arbitrates between
// them, behind one interface.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "bench/harness/report.hpp"

namespace arbiter::bench {

enum class Party : std::uint8_t { kOld, kOverride };

struct Contest {
  std::int64_t timeout_ns = 500'000'000;  // a source that is silent for so long commands no more
  // Whether a silence is part of what is measured. Where not, release() is.
  bool falls_silent = false;
  std::string unique;  // as in Exchange
};

// What came out at the destination.
struct Taken {
  enum class Kind : std::uint8_t { kNothing, kSample, kIdle };
  Kind kind = Kind::kNothing;
  Party party = Party::kOld;
  std::uint64_t number = 0;
};

// A worker's, with both sources in it: one core is theirs, the other the destination's.
class Sources {
 public:
  Sources() = default;
  Sources(const Sources&) = delete;
  Sources& operator=(const Sources&) = delete;
  virtual ~Sources() = default;

  // A sample of 64 bytes.
  virtual void publish(Party party, std::uint64_t number) = 0;
  // The override commands no more, from now on.
  virtual void release() = 0;
};

class Destination {
 public:
  Destination() = default;
  Destination(const Destination&) = delete;
  Destination& operator=(const Destination&) = delete;
  virtual ~Destination() = default;

  virtual Taken take() = 0;  // does not block
  // Blocks until there is a sample or the destination is idle; after a second, kNothing.
  virtual Taken wait() = 0;
};

// As Session: made before the workers are.
class ContestSession {
 public:
  ContestSession() = default;
  ContestSession(const ContestSession&) = delete;
  ContestSession& operator=(const ContestSession&) = delete;
  virtual ~ContestSession() = default;

  virtual std::unique_ptr<Sources> open_sources() = 0;
  virtual std::unique_ptr<Destination> open_destination() = 0;
};

struct ContestSystem {
  std::string name;
  Role role;
  std::unique_ptr<ContestSession> (*prepare)(const Contest& contest);
};

std::unique_ptr<ContestSession> arbiter_contest(const Contest& contest);
std::unique_ptr<ContestSession> cyclone_contest(const Contest& contest);
std::unique_ptr<ContestSession> relay_contest(const Contest& contest);

// The floor of failover: nobody arbitrates, each party knows when its time has come.
std::unique_ptr<ContestSession> pipe_and_timer(const Contest& contest);

// All but the floor.
const std::vector<ContestSystem>& contest_systems();

// How parties and numbers go into a sample of 64 bytes, where there are but bytes.
struct ContestSample {
  std::uint64_t party;
  std::uint64_t number;
  std::uint64_t rest[6];
};
static_assert(sizeof(ContestSample) == 64);

inline Taken taken(const ContestSample& sample) {
  return {Taken::Kind::kSample, static_cast<Party>(sample.party), sample.number};
}

}  // namespace arbiter::bench
