// Who offers one source, and whom of them an importer takes it from (speaker.hpp).
//
// The end of an offer may go unheard: a host that hears nobody is heard all the same, and once it
// hears again it tells what stands there, not what has ended meanwhile. So an offer is not believed
// for as long as the transport keeps it:
//   - of those of one participant only the newest is true: a host has a source open once;
//   - one whose host says otherwise is over: its card (host_card.hpp) names what is open there;
//   - so is one whose host does not pulse (pulse.hpp): for how long the transport keeps what it has
//     heard of a host, that host itself has said.
//
// Units: nanoseconds of a monotonic clock. Thread safety: none of its own.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "link/core/cards.hpp"
#include "link/core/host_card.hpp"
#include "link/core/participant.hpp"
#include "link/core/speaker.hpp"

namespace arbiter::link {

struct Offer {
  std::uint64_t key = 0;  // by which the transport knows its writer
  OfferCard card;
  Participant participant{};  // whose writer it is
};

// Of two offers of one participant. An exporter counts its incarnations up, and may come round.
[[nodiscard]] constexpr bool is_newer(Incarnation one, Incarnation other) noexcept {
  return static_cast<std::int64_t>(one - other) > 0;
}

// What is known of those who offer.
struct OtherLinks {
  // They do not hear this link (pulse.hpp), and so do not speak to it.
  std::set<Participant> deaf;
  std::map<Participant, std::shared_ptr<const HostCard>> cards;  // none is null
  std::optional<std::set<Participant>> pulsing{};                // nothing: it is not known
};

class Offers {
 public:
  // Twice the lease: an earlier life of a host is not believed to live for so long.
  static constexpr shm::Nanoseconds kNoEarlierLife = 3'000'000'000;
  // A host that does not name the source for so long, or does not pulse, does not have it: cards
  // and pulses come later than the offer, and on a bad network much later.
  static constexpr shm::Nanoseconds kUnnamed = 3'000'000'000;

  explicit Offers(std::string source) : source_(std::move(source)) {}

  // All offers that stand now. Those of other sources are passed over.
  void look(const std::vector<Offer>& offers, const OtherLinks& others, shm::Nanoseconds now);

  // Null: nobody offers the source.
  [[nodiscard]] const Offer* speaker() const;
  // In byte order, each once: more than one is worth a warning.
  [[nodiscard]] std::vector<std::string> hosts() const { return speaker_.hosts(); }
  // Of several machines that have one name; empty: there is none.
  [[nodiscard]] const std::string& shared_name() const noexcept { return shared_name_; }

 private:
  struct Seen {
    Offer offer;
    shm::Nanoseconds since = 0;
    shm::Nanoseconds unnamed = 0;  // since when its host does not stand by it; 0: it does
    bool is_over = false;
  };
  void find_newest(const std::vector<Offer>& offers);
  void judge(Seen& seen, const OtherLinks& others, shm::Nanoseconds now) const;
  void find_shared_name(shm::Nanoseconds now);

  const std::string source_;
  Speaker speaker_;
  std::map<std::uint64_t, Seen> seen_;         // by their keys
  std::map<Participant, Incarnation> newest_;  // of all who have an offer that stands
  std::string shared_name_;
};

}  // namespace arbiter::link
