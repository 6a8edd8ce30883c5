// What an importing host wants of a source now, and what the exporting host sends by it. A sample
// that loses at all ports of a host costs the network nothing there: losers stay at home.
//
// An importer asks for all samples until the source has lost for a while at each arrival, and again
// at once when it wins. An exporter sends to all importers the same, so the one that wants most
// decides; one that has said nothing wants all. Where it sends no sample it sends the event's
// header, at once, which is an arrival like any other: activities are the same with and without.
//
// Units: nanoseconds of a monotonic clock, given by the caller. Thread safety: none of its own.
#pragma once

#include <cstddef>
#include <cstdint>

#include "shm/activity.hpp"

namespace arbiter::link {

// In ascending order of what stays at home.
enum class Demand : std::uint8_t {
  kSamples = 1,   // all of them
  kSmallSamples,  // those up to kSmallSample: the source loses
  kHeaders,       // none: no port is connected to it
};

// Samples up to this size cost about as much as their headers, and always cross to a host that has
// a port for them.
inline constexpr std::size_t kSmallSample = 1024;

// Whether a sample of that size stays at home.
[[nodiscard]] constexpr bool is_withheld(Demand demand, std::size_t size) noexcept {
  return demand == Demand::kHeaders || (demand == Demand::kSmallSamples && size > kSmallSample);
}

// What the model in force does with an imported source.
enum class SourceUse : std::uint8_t {
  kNone,     // a component of this host has it open, and the import is not heard
  kSensed,   // rules read it, and nothing is connected to it
  kForever,  // connected; T never ends its activity: a winner may be silent for long
  kFinite,   // connected, with a finite T
};

class ImportDemand {
 public:
  // For so long a source has lost without a break before its samples stay at home: one that wins
  // and loses by turns pays for each return with a round trip.
  static constexpr shm::Nanoseconds kLosesFor = 100'000'000;

  ImportDemand(SourceUse use, shm::Nanoseconds now) noexcept { begin(use, now); }

  [[nodiscard]] Demand demand() const noexcept { return demand_; }
  // Begins again where it is another use.
  void set_use(SourceUse use, shm::Nanoseconds now) noexcept;
  // After each arrival here: whether a port or a tap has use for samples of it now.
  void note_arrival(bool wants_samples, shm::Nanoseconds now) noexcept;
  // Whether a header alone is believed to be an arrival, where a sample may be `max_age` old. An
  // exporter that has been asked for samples, and for longer than that sends none, holds the place
  // of a winner that nobody hears: it is taken for silent.
  [[nodiscard]] bool believes_header(shm::Nanoseconds max_age,
                                     shm::Nanoseconds now) const noexcept {
    return demand_ != Demand::kSamples || now - asked_ <= max_age;
  }
  // Another exporter is obeyed, which has not been asked yet.
  void begin_exporter(shm::Nanoseconds now) noexcept { asked_ = now; }

 private:
  void begin(SourceUse use, shm::Nanoseconds now) noexcept;

  SourceUse use_ = SourceUse::kNone;
  Demand demand_ = Demand::kSamples;
  bool loses_ = false;
  shm::Nanoseconds loses_since_ = 0;
  shm::Nanoseconds asked_ = 0;  // since when all samples are wanted
};

}  // namespace arbiter::link
