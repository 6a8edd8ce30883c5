// The hosts that a link knows: those whose links are there, and for some minutes those that were.
//
// A link is there while its card's writer is: the transport says when that is lost (a lease). How
// long a lease is, its host says itself, so who does not pulse either (pulse.hpp) is gone. A link
// that is started again has another incarnation; its earlier life is then not listed as gone.
//
// Their number is bounded. Whoever has all hosts do something must not pass over one that has no
// place, so those are counted: hosts that are there and found none, and those that are gone and
// found none, or gave way to others before their minutes were over.
//
// So is that of the ports that their cards name, for all of them are kept and compared. Where they
// are too many, whoever names most loses them, and is known as one that has more than it can name.
//
// Units: nanoseconds of a monotonic clock. Thread safety: none of its own.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "link/core/host_card.hpp"
#include "link/core/participant.hpp"

namespace arbiter::link {

struct Neighbour {
  std::uint64_t key = 0;  // by which the transport knows its card's writer; 0: it is gone
  std::shared_ptr<const HostCard> card;  // never null; copies cost little, however large it is
  bool is_up = true;
  shm::Nanoseconds since = 0;  // that it is up, or gone
  shm::Nanoseconds heard = 0;  // when its card came
  Participant participant{};   // whose writer that is
};

class Neighbours {
 public:
  // Of all, whoever pretends to be one.
  static constexpr std::size_t kMost = 256;
  // Of each kind that has no place; more are not counted.
  static constexpr std::size_t kMostWithoutPlace = 1024;
  // Ports that all of them name together: 256 of each host.
  static constexpr std::size_t kMostNames = 65'536;
  static constexpr shm::Nanoseconds kRemembered = 300'000'000'000;

  // The card of a writer that is there. False: there is no place for another host. Its card does
  // not come again by itself, so it stays without one until it has something new to say.
  bool note(std::uint64_t key, HostCard card, shm::Nanoseconds now,
            const Participant& participant = {});
  // A link whose card has come is to pulse within that time.
  static constexpr shm::Nanoseconds kUnheard = 10'000'000'000;
  // All writers that were there at that time, or later: whose is not among them is gone. Who has
  // been heard since then may have come after they were counted, and is left alone. `pulsing`: who
  // pulses; nothing: it is not known.
  void keep(std::vector<std::uint64_t> keys, shm::Nanoseconds then,
            const std::optional<std::set<Participant>>& pulsing = {});

  // In the order of names, those that are up first.
  [[nodiscard]] const std::vector<Neighbour>& all() const noexcept { return all_; }
  // Hosts that are not among them because they are too many.
  [[nodiscard]] std::size_t without_place() const noexcept {
    return turned_away_.size() + gone_unlisted_.size();
  }
  // Grows with each change of them.
  [[nodiscard]] std::uint64_t changes() const noexcept { return changes_; }

 private:
  struct TurnedAway {
    std::string host;
    shm::Nanoseconds heard = 0;
    Participant participant{};
  };
  bool make_place();
  void turn_away(std::uint64_t key, const std::string& host, shm::Nanoseconds now,
                 const Participant& participant);
  // Whether one is there, by its key, when it was heard, and whose writer it is.
  using IsThere = std::function<bool(std::uint64_t, shm::Nanoseconds, const Participant&)>;
  void keep_count(const IsThere& is_there, shm::Nanoseconds then);
  void remember(const std::string& host, shm::Nanoseconds gone_since);
  void bound_names();
  void put_in_order();

  std::vector<Neighbour> all_;
  std::map<std::uint64_t, TurnedAway> turned_away_;        // by their keys
  std::map<std::string, shm::Nanoseconds> gone_unlisted_;  // by their names: since when
  std::uint64_t changes_ = 0;
};

}  // namespace arbiter::link
