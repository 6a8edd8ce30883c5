// What one host's recording tells, in the checker's words.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "evidence/records.hpp"
#include "tests/link/failures/command.hpp"
#include "tests/link/failures/time.hpp"

namespace arbiter::failures {

// An arrival or a deactivation.
struct Happened {
  enum class Kind : std::uint8_t { sample, signal, deactivation, gap };
  Kind kind = Kind::sample;
  Nanoseconds time = 0;  // by its publisher at this host
  Nanoseconds seen = 0;  // the recorder knew of it
  bool won = false;      // at the host's motor
  std::optional<Command> command{};
  // Of one that came from another host: its export there, and its number by its publisher.
  std::uint64_t exporter = 0;
  std::uint64_t sequence = 0;
  std::uint64_t events = 0;  // gap: that the recorder does not have
  // Deactivation: a port had ended before the recorder joined it; why, it does not say.
  bool is_state = false;
};

// That a model came into force.
struct ModelInForce {
  Nanoseconds time = 0;
  std::uint64_t generation = 0;
  std::string name;
  std::string how;
};

struct HostEvidence {
  std::string name;
  std::map<std::string, std::vector<Happened>> sources;  // each in its order
  std::vector<ModelInForce> models;                      // by time
  // When ports of a source were closed, or whoever had them died, by the daemon.
  std::map<std::string, std::vector<Nanoseconds>> closures;
  // When the component began that publishes the host's source, each time.
  std::vector<Nanoseconds> lives;
  // When daemons began that knew nothing of any activity before.
  std::vector<Nanoseconds> beginnings;
  std::uint64_t decisions = 0;
  std::uint64_t uncertain = 0;     // of which the recording does not have all
  std::vector<std::string> wrong;  // decisions that the host's model does not permit
};

// The model was in force from then on until then, and no other.
[[nodiscard]] bool had_model(const HostEvidence& evidence, const std::string& name,
                             Nanoseconds from, Nanoseconds to);
// Of that source only, and what the host of that number has published.
[[nodiscard]] HostEvidence said_by(const HostEvidence& evidence, const std::string& source,
                                   unsigned host);

// Whether the component had another life before the later time. Of what that published first, its
// recorder has nothing.
[[nodiscard]] bool began_between(const HostEvidence& host, Nanoseconds earlier, Nanoseconds later);

// Where a recorder does not take a source's samples, tells whose they are: of the host's own, by
// when its component's lives began; of others, by what their exporter has published with that
// number before, unless another life may have published it as well.
void name_own(HostEvidence& evidence, const std::string& source, unsigned host);
void name_imported(HostEvidence& evidence, const HostEvidence& exporter, const std::string& source);

// Adds what happened at `motor`.
void add(HostEvidence& evidence, const std::string& motor, const evidence::Record& record);
// Of one recording, with all its decisions taken again. Throws.
[[nodiscard]] HostEvidence read_evidence(const std::string& name, const std::string& motor,
                                         const std::string& path);

}  // namespace arbiter::failures
