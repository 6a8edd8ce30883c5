#include "tests/stress/tap_accounts.hpp"

#include <algorithm>
#include <string>

namespace arbiter::stress {
namespace {

// States and changes of destinations, which are lost as well, and which no publisher writes down.
constexpr std::uint64_t kMostOthersLost = 32;

class TapCheck {
 public:
  TapCheck(Records& records, const ComponentPlan& tap, std::uint32_t last_incarnation)
      : records_(records),
        arrivals_(records.arrivals[tap.watches]),
        seen_(records.seen[tap.log]),
        last_incarnation_(last_incarnation),
        name_("a tap of " + source_name(tap.watches)) {}

  TapsChecked run() {
    TapsChecked checked;
    std::uint32_t incarnation = 0;
    for (std::uint64_t i = 0; i < seen_.size(); ++i) {
      const Seen& event = seen_.records[i];
      if (event.incarnation != incarnation) has_begun_ = false;
      incarnation = event.incarnation;
      checked.lost += event.lost;
      ++checked.events;
      check(event);
    }
    // One that was killed has not seen all, and its successor may have come too late to see any.
    const bool lives = incarnation == last_incarnation_;
    if (lives && !seen_.is_full()) require_all_is_told(false);
    return checked;
  }

 private:
  void fail(const std::string& what) { records_.fail(name_ + ' ' + what); }

  void check(const Seen& event) {
    switch (event.what) {
      case Seen::kState:
        // It has joined, or goes on behind a gap.
        if (event.lost == 0) has_begun_ = false;
        lost_ += event.lost;
        break;
      case Seen::kClosed:
        require_all_is_told(event.lost != 0);
        has_begun_ = false;
        break;
      case Seen::kArrival:
        check_arrival(event);
        break;
    }
  }

  void check_arrival(const Seen& event) {
    const Arrival* const begin = arrivals_.records;
    const Arrival* const next =
        std::upper_bound(begin, begin + arrivals_.size(), event.time,
                         [](std::int64_t time, const Arrival& each) { return time < each.begin; });
    if (next == begin) return fail("has seen what was not published yet");
    const Arrival& arrival = next[-1];
    const auto index = static_cast<std::uint64_t>(&arrival - begin);
    const std::int64_t end = arrival.end.load();
    if (end != 0 && event.time > end) return fail("has seen what nobody published");
    if (arrival.act != event.act) fail("has seen a call as another");
    if (has_begun_ && index <= last_) fail("has seen an event twice, or out of order");
    if (has_begun_ && index > last_) check_gap(index);
    if (event.number != 0 &&
        (event.number != arrival.number || event.publisher != arrival.incarnation)) {
      fail("has read sample " + std::to_string(event.number) + " as " +
           std::to_string(arrival.number));
    }
    const bool is_as_returned = event.accepted == arrival.delivered &&
                                event.discarded == arrival.discarded &&
                                event.refused == arrival.refused;
    if (event.act == Act::kSample && event.knows_fates && end != 0 && !is_as_returned) {
      fail("has seen other fates than publish() returned");
    }
    has_begun_ = true;
    last_ = index;
    lost_ = 0;
  }

  // Of those between the last one seen and this one.
  void check_gap(std::uint64_t index) {
    std::uint64_t missing = 0;
    for (std::uint64_t i = last_ + 1; i < index; ++i) missing += is_over(i) ? 1 : 0;
    if (missing > lost_) {
      fail("misses " + std::to_string(missing) + ", and was told of " + std::to_string(lost_));
    }
    if (lost_ > index - last_ - 1 + kMostOthersLost) {
      fail("was told that " + std::to_string(lost_) + " are lost, of " +
           std::to_string(index - last_ - 1));
    }
  }

  // `one_is_lost`: the tap was told so at the end of a publisher.
  void require_all_is_told(bool one_is_lost) {
    const std::uint64_t next = last_ + 1;
    if (!has_begun_) return;
    const bool is_there = next < arrivals_.size() && arrivals_.records[next].incarnation ==
                                                         arrivals_.records[last_].incarnation;
    if (is_there && is_over(next) && lost_ == 0) fail("has not seen the last");
    if (one_is_lost && (!is_there || is_over(next))) fail("was told of a loss that was none");
    lost_ = 0;
  }

  [[nodiscard]] bool is_over(std::uint64_t index) const {
    return arrivals_.records[index].end.load() != 0;
  }

  Records& records_;
  const Log<Arrival>& arrivals_;
  const Log<Seen>& seen_;
  const std::uint32_t last_incarnation_;
  const std::string name_;
  bool has_begun_ = false;
  std::uint64_t last_ = 0;  // index of the last arrival that was seen
  std::uint64_t lost_ = 0;  // events since then
};

}  // namespace

TapsChecked check_taps(const Plan& plan, Records& records) {
  TapsChecked sum;
  for (std::size_t i = 0; i < plan.components.size(); ++i) {
    if (plan.components[i].watches == kNobody) continue;
    const std::uint32_t last_incarnation = records.components[i].incarnation.load();
    const TapsChecked one = TapCheck(records, plan.components[i], last_incarnation).run();
    sum.events += one.events;
    sum.lost += one.lost;
  }
  return sum;
}

}  // namespace arbiter::stress
