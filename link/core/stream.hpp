// The events of one source as other hosts send them: in order, none twice, losses counted.
//
// An exporter numbers what happens to a source from 1 upwards: samples, signals, deactivations;
// what it could not see itself has used numbers as well. It begins again whenever it offers the
// source again, because its own process or the publisher was started again: so a stream is known by
// its source and the incarnation of the offer. The last event of a stream tells the source's state:
// an importer that joins, or has missed some, needs only that.
//
// Thread safety: none of its own.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "link/core/held_tokens.hpp"

namespace arbiter::link {

struct StreamEvent {
  std::uint64_t number = 0;    // of the exporter
  std::uint64_t sequence = 0;  // of the publisher: of this sample, or of the last one before
  bool has_sample = false;
  bool is_deactivated = false;  // the source is, from here on
  bool is_withheld = false;     // the sample may come later, with the number of the last event
  bool is_unasked = false;      // its exporter had heard nothing of this importer when it happened
};

class Stream {
 public:
  // From now on `exporter` is the one that is obeyed, with the state that it was last known to
  // have.
  void obey(Incarnation exporter) noexcept;
  // Nobody listens from now on: what is sent until the next event is taken up is not missed.
  void pause() noexcept { has_begun_ = false; }
  // Takes up an event of the exporter `from`, which is the one that is obeyed. False: it,
  // or a later one, came before.
  bool note(Incarnation from, const StreamEvent& event) noexcept;

  // Whether a sample with this number, which is sent again, belongs to the last arrival, and has
  // not come yet. Then it is no other event; else note() judges it as any other.
  bool completes(Incarnation from, std::uint64_t number) noexcept;

  // Events that have not come, and will not. What an exporter sent before it knew this importer, or
  // while another one was obeyed or nobody listened, is not missed.
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }
  [[nodiscard]] std::uint64_t doubled() const noexcept { return doubled_; }
  // By the last event of the one that is obeyed: it ended the source's activity, and nothing has
  // come since.
  [[nodiscard]] bool is_deactivated() const noexcept { return exporters_.front().is_deactivated; }
  // Whether such an end is to be applied here: not if it has been, and is only said once more.
  [[nodiscard]] bool take_end() noexcept {
    return std::exchange(exporters_.front().is_end_due, false);
  }

 private:
  // The exporters that were obeyed last: one that comes back goes on where it was, and what it
  // sends again is known.
  static constexpr std::size_t kRemembered = 8;
  struct Exporter {
    Incarnation incarnation = 0;  // 0: none
    std::uint64_t last = 0;       // number
    std::uint64_t sequence = 0;   // likewise
    bool is_deactivated = false;  // likewise
    bool is_end_due = false;      // it is, and take_end() has not said so
    bool is_awaited = false;      // the sample of the last arrival
  };
  void move_to_front(Incarnation from) noexcept;
  [[nodiscard]] static std::uint64_t missed(const Exporter& exporter,
                                            const StreamEvent& event) noexcept;

  std::array<Exporter, kRemembered> exporters_{};  // the one that is obeyed first
  // An event of that one was taken up since it is, which happened when it knew this importer.
  bool has_begun_ = false;
  std::uint64_t lost_ = 0;
  std::uint64_t doubled_ = 0;
};

}  // namespace arbiter::link
