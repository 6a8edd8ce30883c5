#include "tests/stress/components.hpp"

#include <sched.h>
#include <unistd.h>

#include <chrono>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <arbiter/arbiter.hpp>

namespace arbiter::stress {
namespace {

using std::chrono::milliseconds;

class Worker {
 public:
  Worker(const Plan& plan, Records& records, std::uint32_t component, std::uint32_t incarnation)
      : plan_(plan),
        records_(records),
        state_(records.components[component]),
        incarnation_(incarnation),
        random_(plan.seed * 1000 + component * 50 + incarnation),
        node_("stress-" + std::to_string(component), {.connect_timeout = milliseconds(20'000)}) {}

 protected:
  // A dead predecessor has the name until the daemon has noticed.
  template <class Open>
  auto open(Open open_port) {
    for (;;) {
      try {
        return open_port();
      } catch (const Error& error) {
        if (incarnation_ == 1 || std::string(error.what()).find("is held by") == std::string::npos)
          throw;
      }
    }
  }
  auto open_output(std::uint32_t source) {
    const SourcePlan& plan = plan_.sources[source];
    return open([&] {
      return node_.output_port(
          source_name(source),
          {.max_size = kMaxSample, .max_loans = plan.max_loans, .max_memory = plan.max_memory});
    });
  }
  auto open_input(std::uint32_t port) {
    const PortPlan& plan = plan_.ports[port];
    return open([&] {
      return node_.input_port(port_name(port),
                              {.depth = plan.depth,
                               .when_full = plan.refuse_new ? refuse_new : drop_oldest,
                               .keep = plan.keep,
                               .max_held = plan.max_held});
    });
  }

  void say_open() {
    for (auto* counter : {&state_.published, &state_.signals, &state_.delivered, &state_.discarded,
                          &state_.refused, &state_.taken}) {
      counter->store(0, std::memory_order_relaxed);
    }
    const std::int64_t now = read_clock();
    state_.last_step.store(now, std::memory_order_relaxed);
    state_.opened_at.store(now, std::memory_order_relaxed);
    state_.incarnation.store(incarnation_, std::memory_order_release);
    records_.await_phase_after(kOpening);
  }
  void step(std::int64_t now) {
    add(state_.steps);
    state_.pauses.add(now - state_.last_step.load(std::memory_order_relaxed));
    state_.last_step.store(now, std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint32_t phase() const {
    return records_.phase.load(std::memory_order_acquire);
  }
  void finish(Phase of) {
    state_.done.store(of, std::memory_order_release);
    records_.await_phase_after(kReceiversStop);
  }

  const Plan& plan_;
  Records& records_;
  ComponentState& state_;
  const std::uint32_t incarnation_;
  Random random_;
  Node node_;
};

// The publishing half.
class Source : public virtual Worker {
 public:
  Source(const Plan& plan, Records& records, std::uint32_t component, std::uint32_t incarnation)
      : Worker(plan, records, component, incarnation),
        source_(plan.components[component].source),
        log_(records.arrivals[source_]),
        port_(open_output(source_)) {}

 protected:
  void publish() {
    const std::uint64_t number = ++log_.samples;
    const SampleHead head{0, number, source_, incarnation_, random_.below(kMaxWords + 1)};
    Arrival& record = begin(Act::kSample, number);
    Outcome outcome;
    if (random_.one_in(2)) {
      auto loan = port_.loan(sample_size(head.words));
      if (!loan) {
        records_.fail(source_name(source_) + " found no slot to lend");
        return;
      }
      write_sample(loan->data(), head, random_);
      record.begin = read_clock();
      outcome = port_.publish(std::move(*loan));
    } else {
      std::byte bytes[kMaxSample];
      write_sample(bytes, head, random_);
      record.begin = read_clock();
      outcome = port_.publish(Bytes(bytes, sample_size(head.words)));
    }
    end(record, outcome);
    add(state_.published);
    add<std::uint64_t>(state_.delivered, outcome.delivered);
    add<std::uint64_t>(state_.discarded, outcome.discarded);
    add<std::uint64_t>(state_.refused, outcome.refused);
  }
  void signal() {
    Arrival& record = begin(Act::kSignal, 0);
    end(record, port_.signal());
    add(state_.signals);
  }
  void deactivate() {
    Arrival& record = begin(Act::kDeactivate, 0);
    port_.deactivate();
    end(record, {});
  }
  // A burst, then silence: its activity runs out, or ends at once, or goes on.
  void publish_at_random() {
    const SourcePlan& plan = plan_.sources[source_];
    for (std::uint32_t i = 1 + random_.below(plan.burst); i != 0 && !log_.is_full(); --i) {
      if (random_.one_in(10)) {
        signal();
      } else {
        publish();
      }
    }
    if (log_.is_full()) return;
    if (!random_.one_in(plan.timeout_ns == 0 ? 4 : 2)) deactivate();
    const std::uint32_t pause = random_.below(plan.pause_us * 1000);
    if (pause > 1'000'000) {
      usleep(pause / 1000);
      return;
    }
    const std::int64_t until = read_clock() + pause;
    while (read_clock() < until) sched_yield();
  }

  const std::uint32_t source_;
  Log<Arrival>& log_;

 private:
  // Committed before the call: whoever finds it has to reckon with it.
  Arrival& begin(Act act, std::uint64_t number) {
    Arrival& record = log_.next();
    record.end.store(0, std::memory_order_relaxed);
    record.number = number;
    record.incarnation = incarnation_;
    record.act = act;
    record.begin = read_clock();
    log_.commit();
    return record;
  }
  void end(Arrival& record, const Outcome& outcome) {
    const std::int64_t now = read_clock();
    record.delivered = static_cast<std::uint8_t>(outcome.delivered);
    record.discarded = static_cast<std::uint8_t>(outcome.discarded);
    record.refused = static_cast<std::uint8_t>(outcome.refused);
    record.end.store(now, std::memory_order_release);
    step(now);
  }

  OutputPort<void> port_;
};

// The receiving half.
class Sink : public virtual Worker {
 public:
  Sink(const Plan& plan, Records& records, std::uint32_t component, std::uint32_t incarnation)
      : Worker(plan, records, component, incarnation),
        index_(plan.components[component].port),
        log_(records.takings[index_]),
        port_(open_input(index_)) {}

 protected:
  // Whether there was a sample.
  bool take() {
    if (held_.size() == plan_.ports[index_].max_held) give_back();
    const std::int64_t before = read_clock();
    std::optional<Sample<void>> sample = port_.take();
    if (!sample && plan_.ports[index_].waits && random_.one_in(8) && phase() == kRunning) {
      auto waited = port_.wait_for(milliseconds(2));
      if (waited) sample = std::move(*waited);
    }
    const std::int64_t after = read_clock();
    step(after);
    if (!sample) return false;
    record(*sample, before, after);
    held_.push_back(std::move(*sample));
    if (random_.one_in(2)) give_back();
    return true;
  }
  // All that waits. One empty take does not prove that nothing does: the picture may not have
  // settled.
  void drain() {
    for (int empty = 0; empty < 20;) empty = take() ? 0 : empty + 1;
  }
  void give_back() {
    SampleHead head{};
    if (!read_sample(held_.front().data(), held_.front().size(), head)) {
      records_.fail(port_name(index_) + " held a sample of " + held_.front().source() +
                    " that was changed");
    }
    held_.pop_front();
  }
  void give_back_all() {
    while (!held_.empty()) give_back();
  }

  const std::uint32_t index_;
  Log<Taking>& log_;

 private:
  void record(const Sample<void>& sample, std::int64_t before, std::int64_t after) {
    add(state_.taken);
    SampleHead head{};
    if (!read_sample(sample.data(), sample.size(), head)) {
      records_.fail(port_name(index_) + " took a torn sample of " + sample.source() + ", " +
                    std::to_string(sample.size()) + " bytes that say number " +
                    std::to_string(head.number));
      return;
    }
    if (head.source >= plan_.sources.size() || source_name(head.source) != sample.source()) {
      records_.fail(port_name(index_) + " took a sample of " + sample.source() +
                    " that was published by " + source_name(head.source));
      return;
    }
    if (log_.is_full()) return;  // the round ends; so much is enough
    Taking& taking = log_.next();
    taking = {before, after, sample.stamp_ns(), head.number, head.source, incarnation_};
    log_.commit();
  }

  InputPort<void> port_;
  std::deque<Sample<void>> held_;
};

class Publisher : public Source {
 public:
  Publisher(const Plan& plan, Records& records, std::uint32_t component, std::uint32_t incarnation)
      : Worker(plan, records, component, incarnation),
        Source(plan, records, component, incarnation) {}

  void run() {
    say_open();
    while (phase() == kRunning && !log_.is_full()) publish_at_random();
    finish(kPublishersStop);
  }
};

class Receiver : public Sink {
 public:
  Receiver(const Plan& plan, Records& records, std::uint32_t component, std::uint32_t incarnation)
      : Worker(plan, records, component, incarnation),
        Sink(plan, records, component, incarnation) {}

  void run() {
    say_open();
    while (phase() < kReceiversStop) {
      if (!take()) sched_yield();
    }
    drain();
    state_.done.store(kReceiversStop, std::memory_order_release);
    // What a dead publisher has left may still come.
    while (phase() < kEnd) {
      take();
      usleep(500);
    }
    give_back_all();
  }
};

// Writes down what its tap tells.
class Watcher : public virtual Worker {
 public:
  Watcher(const Plan& plan, Records& records, std::uint32_t component, std::uint32_t incarnation)
      : Worker(plan, records, component, incarnation),
        source_(plan.components[component].watches),
        log_(records.seen[plan.components[component].log]),
        tap_(node_.tap(source_name(source_), {.max_held = 2, .may_wait = random_.one_in(2)})) {}

  void run() {
    say_open();
    while (phase() < kReceiversStop) {
      const std::int64_t before = read_clock();
      if (!look(before)) sched_yield();
      if (random_.one_in(4000)) usleep(5000);  // and is overtaken
    }
    // All that there is: one empty look does not prove that nothing comes, while others come and
    // go.
    for (int empty = 0; empty < 20;) empty = look(read_clock()) ? 0 : empty + 1;
    finish(kReceiversStop);
  }

 private:
  bool look(std::int64_t now) {
    auto event = tap_.take();
    step(now);
    if (!event || log_.is_full()) return false;
    Seen& seen = log_.next();
    seen = {};
    seen.time = event->time().time_since_epoch().count();
    seen.lost = event->lost();
    seen.incarnation = incarnation_;
    switch (event->kind()) {
      case TapEventKind::state:
        seen.what = Seen::kState;
        break;
      case TapEventKind::closed:
        seen.what = Seen::kClosed;
        break;
      case TapEventKind::sample:
      case TapEventKind::signal:
      case TapEventKind::deactivation:
        note(*event, seen);
        break;
      default:
        return true;
    }
    log_.commit();
    return true;
  }

  void note(const TapEvent<>& event, Seen& seen) {
    seen.what = Seen::kArrival;
    seen.act = event.kind() == TapEventKind::sample   ? Act::kSample
               : event.kind() == TapEventKind::signal ? Act::kSignal
                                                      : Act::kDeactivate;
    for (const TapDestination& met : event.destinations()) {
      seen.knows_fates = true;
      if (met.fate == Fate::accepted) ++seen.accepted;
      if (met.fate == Fate::refused) ++seen.refused;
      if (met.fate == Fate::discarded || met.fate == Fate::blind) ++seen.discarded;
    }
    if (!event.sample()) return;
    SampleHead head{};
    if (!read_sample(event.sample()->data(), event.sample()->size(), head)) {
      records_.fail("a tap of " + source_name(source_) + " read a torn sample");
      return;
    }
    seen.number = head.number;
    seen.publisher = head.incarnation;
  }

  const std::uint32_t source_;
  Log<Seen>& log_;
  Tap<> tap_;
};

// Publishes what it takes.
class Relay : public Source, public Sink {
 public:
  Relay(const Plan& plan, Records& records, std::uint32_t component, std::uint32_t incarnation)
      : Worker(plan, records, component, incarnation),
        Source(plan, records, component, incarnation),
        Sink(plan, records, component, incarnation) {}

  void run() {
    say_open();
    while (phase() < kRelaysStop) {
      if (!take()) {
        sched_yield();
        continue;
      }
      if (!Source::log_.is_full()) publish();
      if (random_.one_in(4) && !Source::log_.is_full()) deactivate();
    }
    drain();
    state_.done.store(kRelaysStop, std::memory_order_release);
    while (phase() < kEnd) {
      take();
      usleep(500);
    }
    give_back_all();
  }
};

}  // namespace

void run_component(const Plan& plan, Records& records, std::uint32_t component,
                   std::uint32_t incarnation) {
  const ComponentPlan& what = plan.components[component];
  if (what.watches != kNobody) {
    Watcher(plan, records, component, incarnation).run();
  } else if (what.port == kNobody) {
    Publisher(plan, records, component, incarnation).run();
  } else if (what.source == kNobody) {
    Receiver(plan, records, component, incarnation).run();
  } else {
    Relay(plan, records, component, incarnation).run();
  }
}

}  // namespace arbiter::stress
