#include "recorder/replayer.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "evidence/record_reader.hpp"
#include "recorder/sleep.hpp"
#include "recorder/speed.hpp"
#include "rules/model/quantifiers.hpp"
#include "rules/text/names.hpp"
#include "shm/clock.hpp"

namespace arbiter::recorder {
namespace {

using evidence::Arrival;
using evidence::Nanoseconds;
using evidence::Record;

// The first arrival comes this long after the ports are open.
constexpr Nanoseconds kLead = 20'000'000;

struct Interrupted {};
struct Past {};  // what follows need not be read

Time time_at(Nanoseconds time) { return Time(std::chrono::nanoseconds(time)); }

bool fits(const std::vector<std::string>& patterns, const std::string& name) {
  return patterns.empty() ||
         std::any_of(patterns.begin(), patterns.end(),
                     [&](const std::string& pattern) { return rules::matches(pattern, name); });
}

// The daemon says in words why a port cannot be opened.
bool is_taken(const std::string& refusal) {
  return refusal.find(" is held by ") != std::string::npos;
}

// If it has not answered, other ports are no help.
std::string advice_for(const std::string& refusal, const std::string& port) {
  if (refusal.find(port) == std::string::npos) return "";
  return std::string(is_taken(refusal) ? ". Stop that component, choose" : ". Choose") +
         " other sources with --source, or replay into an instance of its own with --instance";
}

// What `arbiter winners` says of the instance itself counts there, not what it said elsewhere.
bool is_announcement(const std::string& source) { return source.starts_with("/arbiter/winner/"); }

}  // namespace

Replayer::Replayer(const ReplayOptions& options)
    : options_(options), surveyed_(survey(options.file, options.part, options.say, options.watch)) {
  choose();
  if (sources_.empty()) {
    throw NothingChosen(options_.file + " has no arrival of what you have chosen");
  }
  refuse_without_payloads(is_announcement);  // these may be left out
  if (options_.speed > 0)
    require_end(options_.file, surveyed_.latest - surveyed_.first, options_.speed);
  open_ports();
  refuse_without_payloads([](const std::string&) { return false; });
}

void Replayer::choose() {
  for (const auto& [name, source] : surveyed_.sources) {
    const bool has_something =
        source.has_events || shm::is_active(source.at_start, surveyed_.first);
    if (has_something && fits(options_.sources, name) && is_at_chosen_port(name)) {
      sources_.emplace(name, Source{source});
    }
  }
}

bool Replayer::is_at_chosen_port(const std::string& source) const {
  if (options_.ports.empty()) return true;
  const auto& ports = surveyed_.sources_of_ports;
  return std::any_of(ports.begin(), ports.end(), [&](const auto& each) {
    return each.second.contains(source) && fits(options_.ports, each.first);
  });
}

void Replayer::refuse_without_payloads(const Excepted& is_excepted) const {
  std::string without;
  bool has_announcement = false;
  for (const auto& [name, source] : sources_) {
    if (source.samples == 0 || source.payloads != 0 || is_excepted(name)) continue;
    has_announcement = has_announcement || is_announcement(name);
    without += (without.empty() ? "" : ", ") + name;
  }
  if (without.empty()) return;
  throw ReplayError(options_.file + " does not have what was in the samples of " + without +
                    ", so they cannot be published: choose other sources with --source, or record "
                    "with --payloads all" +
                    (has_announcement
                         ? "; announcements of who commands are left out if `arbiter winners` runs "
                           "in the instance"
                         : ""));
}

void Replayer::open_port(const std::string& name, Source& source) {
  const evidence::SourceContext& type = source.type;
  const bool has_one_size = !type.type.empty() && type.alignment != 0;
  const std::uint64_t size = has_one_size ? type.size : std::max(source.largest, type.size);
  source.port.emplace(node_->output_port(
      name, type.type.empty() ? Type::untyped(size) : Type(type.type, size, type.alignment), {}));
}

void Replayer::open_ports() {
  node_.emplace("arbiter-replay", options_.node);
  keeps_times_ = options_.speed > 0;
  std::vector<std::string> announced;
  for (auto& [name, source] : sources_) {
    try {
      open_port(name, source);
    } catch (const Error& error) {
      if (is_announcement(name) && is_taken(error.what())) {
        announced.push_back(name);
        continue;
      }
      throw ReplayError(error.what() + advice_for(error.what(), name));
    }
    if (!keeps_times_) continue;
    try {
      source.port->require_replay();
    } catch (const Error& error) {
      keeps_times_ = false;
      options_.say(std::string(error.what()) +
                   "; arrivals bear the times at which they are published");
    }
  }
  if (announced.empty()) return;
  for (const std::string& name : announced) sources_.erase(name);
  options_.say("not published, for a component there announces who commands: " +
               rules::enumerate(announced));
  if (sources_.empty()) {
    throw NothingChosen(options_.file + " has no other arrival of what you have chosen");
  }
}

Replayed Replayer::run(const shm::FileDescriptor& interrupts) {
  Replayed replayed;
  replayed.sources = sources_.size();
  std::uint64_t read = 0;
  const auto use = [&](Record&& record) {
    const auto* context = evidence::context_of(record);
    const bool is_event = std::holds_alternative<Arrival>(record) ||
                          std::holds_alternative<evidence::Deactivation>(record);
    const Nanoseconds time = evidence::time_of(record);
    if (is_event && options_.part.has(time) && sources_.count(context->source) != 0) {
      begin(interrupts);
      deactivate_untold(time, interrupts, replayed);
      await(time, interrupts);
      publish(record, replayed);
    }
    if (++read >= surveyed_.last_event) throw Past();
  };
  try {
    try {
      evidence::read_recording(options_.file, evidence::Payloads::read, use, {}, options_.part);
    } catch (const Past&) {
    }
    begin(interrupts);
    deactivate_untold(shm::kForever, interrupts, replayed);
  } catch (const Interrupted&) {
    replayed.was_interrupted = true;
  }
  replayed.at_start = active_at_start_;
  if (has_begun_) replayed.time = shm::monotonic_now() - start_;
  return replayed;
}

// With the first event: to come to a part takes time.
void Replayer::begin(const shm::FileDescriptor& interrupts) {
  if (std::exchange(has_begun_, true)) return;
  start_ = last_ = shm::monotonic_now() + kLead;
  if (sleep_until(start_, {interrupts.get()})) throw Interrupted();
  signal_active_ones();
}

// Those that came before that time.
void Replayer::deactivate_untold(Nanoseconds recorded, const shm::FileDescriptor& interrupts,
                                 Replayed& replayed) {
  for (; next_untold_ < surveyed_.untold.size(); ++next_untold_) {
    const evidence::Deactivation& over = surveyed_.untold[next_untold_];
    if (over.time > recorded) break;
    if (sources_.count(over.context->source) == 0) continue;
    renew(over.time, interrupts);
    await(over.time, interrupts);
    publish(over, replayed);
  }
  renew(recorded, interrupts);
}

void Replayer::await(Nanoseconds recorded, const shm::FileDescriptor& interrupts) {
  last_ = due(recorded);
  if (options_.speed > 0 && sleep_until(last_, {interrupts.get()})) throw Interrupted();
}

// Never backwards.
Nanoseconds Replayer::due(Nanoseconds recorded) const {
  if (options_.speed <= 0) return last_;
  return std::max(last_, start_ + at_speed(recorded - surveyed_.first, options_.speed));
}

// A recording begins in the middle of activities. Those that end by themselves end when they did;
// where that is not known they last too long, rather than that those drive whom they keep out.
void Replayer::signal_active_ones() {
  std::vector<std::string> unknown;
  for (auto& [name, source] : sources_) {
    if (!shm::is_active(source.at_start, surveyed_.first)) continue;
    const bool is_forever = !shm::is_finite(source.at_start);
    Nanoseconds arrived =
        is_forever ? surveyed_.first : shm::arrival_of(source.at_start, source.timeout);
    if (!is_forever && source.timeout == shm::kForever) {
      unknown.push_back(name);
      arrived = surveyed_.first;
    } else if (!is_forever && arrived > surveyed_.first) {  // T was longer when it arrived
      plan_renewals(source, std::exchange(arrived, surveyed_.first));
    }
    signal_active(source, arrived);
    ++active_at_start_;
  }
  std::stable_sort(renewals_.begin(), renewals_.end(),
                   [](const Renewal& one, const Renewal& other) { return one.time < other.time; });
  if (unknown.empty()) return;
  options_.say("the recording does not have the T of " + rules::enumerate(unknown) +
               " from before its start: the replay begins with a signal there, and that activity "
               "may last longer than it did");
}

// So that it ends when it did, unless something is told of it before.
void Replayer::plan_renewals(Source& source, Nanoseconds last) {
  constexpr Nanoseconds kMost = 1000;
  const Nanoseconds step =
      std::max({source.timeout / 2, (last - surveyed_.first) / kMost, Nanoseconds{1}});
  for (Nanoseconds time = surveyed_.first + step; time < last; time += step) {
    renewals_.push_back({time, &source});
  }
  renewals_.push_back({last, &source});
}

// Those until then, but none behind all that happens.
void Replayer::renew(Nanoseconds recorded, const shm::FileDescriptor& interrupts) {
  const Nanoseconds until = std::min(recorded, surveyed_.latest);
  for (; next_renewal_ < renewals_.size(); ++next_renewal_) {
    const Renewal& renewal = renewals_[next_renewal_];
    if (renewal.time > until) return;
    if (renewal.source->has_told) continue;
    await(renewal.time, interrupts);
    if (keeps_times_) {
      renewal.source->port->signal_at(time_at(last_));
    } else {
      renewal.source->port->signal();
    }
  }
}

void Replayer::signal_active(Source& source, Nanoseconds arrived) {
  try {
    if (keeps_times_ && options_.speed == 1) {
      source.port->signal_at(time_at(start_ - (surveyed_.first - arrived)));
      return;
    }
  } catch (const Error&) {  // somebody had the source meanwhile
  }
  source.port->signal();
  last_ = shm::monotonic_now() + 1;  // what follows comes later
}

void Replayer::publish(const Record& record, Replayed& replayed) {
  Source& source = sources_.at(evidence::context_of(record)->source);
  source.has_told = true;
  Nanoseconds at = last_;
  if (source.deactivated == at) at = ++last_;
  Nanoseconds now = shm::monotonic_now();
  while (now < at && options_.speed > 0) now = shm::monotonic_now();  // a nanosecond
  if (options_.speed > 0) replayed.latest = std::max(replayed.latest, now - at);
  if (const auto* arrival = std::get_if<Arrival>(&record)) {
    arrive(source, *arrival, at, replayed);
    return;
  }
  ++replayed.deactivations;
  if (keeps_times_) {
    source.port->deactivate_at(time_at(at));
    source.deactivated = at;
  } else {
    source.port->deactivate();
  }
}

void Replayer::arrive(Source& source, const Arrival& arrival, Nanoseconds at, Replayed& replayed) {
  OutputPort<void>& port = *source.port;
  const std::size_t size = arrival.payload ? arrival.payload->size() : 0;
  const bool has_type =
      have_one_type(source.type, *arrival.context) &&
      (port.type().has_one_size() ? size == port.max_size() : size <= port.max_size());
  if (!arrival.payload || !has_type) {
    if (arrival.payload) replayed.changed.insert(arrival.context->source);
    ++(arrival.payload     ? replayed.of_another_type
       : arrival.is_sample ? replayed.without_payload
                           : replayed.signals);
    if (keeps_times_) {
      port.signal_at(time_at(at));
    } else {
      port.signal();
    }
    return;
  }
  ++replayed.samples;
  const Bytes bytes(arrival.payload->data(), arrival.payload->size());
  const Outcome outcome = keeps_times_ ? port.publish_at(time_at(at), bytes) : port.publish(bytes);
  replayed.delivered += outcome.delivered;
  replayed.discarded += outcome.discarded;
  replayed.refused += outcome.refused;
}

}  // namespace arbiter::recorder
