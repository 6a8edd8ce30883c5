// What hosts do not agree upon, by their cards: the same input port open on two of them, the same
// source, the same name for two machines, different models.
//
// A port that moves from one host to another is in two cards for a moment: what has not stood for
// kSettles is not reported. The earlier life of a link that was started again is not heard beside
// the later one, until the two have been there together for kNoEarlierLife.
//
// Units: nanoseconds of a monotonic clock. Thread safety: none of its own.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "link/core/host_card.hpp"

namespace arbiter::link {

enum class DisagreementKind : std::uint8_t { kInputPort, kSource, kHostName, kModel };

[[nodiscard]] constexpr bool is_error(DisagreementKind kind) noexcept {
  return kind == DisagreementKind::kInputPort;
}

struct Disagreement {
  DisagreementKind kind = DisagreementKind::kInputPort;
  std::string name;                // the port's, the source's, the host's; of models: empty
  std::vector<std::string> hosts;  // in byte order

  // A sentence without its end.
  [[nodiscard]] std::string text() const;
  // Else it is a warning.
  [[nodiscard]] bool is_error() const noexcept { return link::is_error(kind); }
};

// A host whose link is there.
struct PresentHost {
  const HostCard* card = nullptr;
  shm::Nanoseconds since = 0;
};

class Disagreements {
 public:
  static constexpr shm::Nanoseconds kSettles = 1'500'000'000;
  // Longer than a lease.
  static constexpr shm::Nanoseconds kNoEarlierLife = 3'000'000'000;
  // Reported at once; a host may say that it has thousands of ports. Where there is no place for an
  // error, the last warning gives way.
  static constexpr std::size_t kMost = 64;

  // Returns those that were not reported before, and those that others have joined or left since,
  // errors first.
  std::vector<Disagreement> look(const std::vector<PresentHost>& hosts, shm::Nanoseconds now);
  // Nobody could be told of it: it is news at the next look again.
  void take_back(const Disagreement& news);
  // Those that stand now, errors first.
  [[nodiscard]] std::vector<Disagreement> standing() const;

 private:
  // One that some host joins or leaves goes on for the others.
  struct Standing {
    std::vector<std::string> hosts;
    shm::Nanoseconds since = 0;     // it has gone on, whoever came and went
    shm::Nanoseconds of_these = 0;  // since when it is about exactly these hosts
    bool stands = false;            // it has settled, and was reported
    bool is_reported = false;       // with these hosts
  };
  using Subject = std::pair<DisagreementKind, std::string>;  // with its name

  [[nodiscard]] bool make_place_for(DisagreementKind kind);
  void update(Subject subject, std::vector<std::string> hosts, shm::Nanoseconds now);

  std::map<Subject, Standing> found_;
};

}  // namespace arbiter::link
