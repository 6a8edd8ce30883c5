// The tokens that a link has from those who import from it, and which of them it held when a sample
// was published.
//
// A sample may have waited in this host, for a link that was stopped or starved. So it names no
// token that came after it was published, although the link holds newer ones when it sends it.
//
// Senders of tokens are strangers: their number is bounded, and one that falls silent is forgotten
// if another one needs its place. Each writer speaks for one importer, so it has one place, however
// many names it makes up.
//
// Units: nanoseconds of CLOCK_MONOTONIC, by which samples are stamped.
//
// Thread safety: any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <vector>

#include "link/core/token_times.hpp"
#include "shm/activity.hpp"

namespace arbiter::link {

// A life: of a link's process, as importers have it, or of one of its offers. A number that differs
// from all others because it was begun at random; never 0.
using Incarnation = std::uint64_t;

// The newest token of one importer.
struct NamedToken {
  Incarnation importer = 0;
  std::uint64_t number = 0;

  friend bool operator==(const NamedToken&, const NamedToken&) = default;
};

// Importers of one host; so a header has a size that is known.
inline constexpr std::size_t kMaxImporters = 64;

class HeldTokens {
 public:
  // An importer that is silent for this long may lose its place to another.
  static constexpr shm::Nanoseconds kSilence = 5'000'000'000;

  // An importer that is silent for this long, longer than a cut that somebody waits for, is
  // forgotten.
  static constexpr shm::Nanoseconds kForgotten = 600'000'000'000;

  // An importer that is silent for this long may go on by another writer: the transport takes one
  // that it has lost for another when it finds it again. Until then others are not heard in its
  // name. Tokens come more often.
  static constexpr shm::Nanoseconds kOtherWriter = 1'200'000'000;

  // `writer`: whose token the transport says it is. False: there is no place for another importer
  // now, or another writer speaks for this one, or this writer for another. A token that is older
  // than one that came before from the same writer changes nothing. Where another writer goes on
  // with an older one, what the writer before had sent is forgotten: it was a stranger's.
  bool note(Incarnation importer, std::uint64_t number, std::uint64_t writer, shm::Nanoseconds now);

  // Of each importer the newest that had come at `published`, into `named`, of which nothing else
  // is kept.
  void name(shm::Nanoseconds published, std::vector<NamedToken>& named) const;

 private:
  struct Held {
    TokenTimes times;
    std::uint64_t writer = 0;
    shm::Nanoseconds heard = 0;
  };

  [[nodiscard]] bool has_other_name(std::uint64_t writer) const;
  void forget_silent(shm::Nanoseconds now);
  bool make_place(shm::Nanoseconds now);

  mutable std::mutex mutex_;
  std::map<Incarnation, Held> held_;
  shm::Nanoseconds sweep_again_ = 0;
};

}  // namespace arbiter::link
