#include "top/sampler.hpp"

#include <algorithm>

#include "rules/explain/change.hpp"
#include "rules/explain/tenure.hpp"
#include "shm/clock.hpp"

namespace arbiter::top {
namespace {

std::string came_into_force(std::uint64_t generation) {
  return "model " + std::to_string(generation) + " came into force";
}

std::chrono::system_clock::time_point earlier(std::chrono::system_clock::time_point wall,
                                              shm::Nanoseconds by) {
  return wall - std::chrono::duration_cast<std::chrono::system_clock::duration>(
                    std::chrono::nanoseconds(by));
}

}  // namespace

Sampler::Sampler(std::shared_ptr<watch::Instance> instance,
                 std::function<std::vector<Accepted>()> collect)
    : instance_(std::move(instance)),
      collect_(std::move(collect)),
      started_(shm::monotonic_now()) {}

void Sampler::set_census(std::shared_ptr<const Census> census) {
  census_ = std::move(census);
  is_bound_ = false;
}

// Ids of names. A daemon with memory of its own has numbered them anew.
void Sampler::bind() {
  if (memory_ != instance_->memory()) {
    memory_ = instance_->memory();
    ++memories_;
    is_bound_ = false;
    seats_.clear();
    paces_.clear();
    last_ = {};
  }
  const shm::TableSnapshot snapshot = memory_->tables().snapshot();
  if (is_bound_ && generation_ == snapshot.generation) return;
  sources_.clear();
  if (snapshot.generation != 0) sources_ = watch::all_sources(snapshot.table);
  port_ids_.clear();
  source_ids_.clear();
  places_.clear();
  if (census_ != nullptr) {
    for (const PortFact& each : census_->ports) {
      port_ids_.push_back(instance_->find_port(each.name).value_or(shm::kNone));
    }
    for (const SourceFact& each : census_->sources) {
      const shm::SourceId id = instance_->find_source(each.name).value_or(shm::kNone);
      if (id != shm::kNone) {
        places_[id] = static_cast<std::int32_t>(source_ids_.size());
        sources_.push_back(id);
      }
      source_ids_.push_back(id);
    }
  }
  std::sort(sources_.begin(), sources_.end());
  sources_.erase(std::unique(sources_.begin(), sources_.end()), sources_.end());
  // If another model has come meanwhile, the next look binds again.
  generation_ = snapshot.generation;
  is_bound_ = memory_->tables().is_whole(snapshot);
}

shm::Nanoseconds Sampler::look() {
  const shm::Nanoseconds began = shm::monotonic_now();
  instance_->update();
  bind();
  const auto these = [this](const shm::TableView&) { return sources_; };
  watch::Picture picture = watch::take_picture(*memory_, these);
  const bool is_of_binding = picture.snapshot.generation == generation_;
  before_ = std::exchange(last_, std::move(picture));
  wall_ = std::chrono::system_clock::now();
  if (collect_) {
    std::vector<Accepted> told = collect_();
    arrivals_.add(std::move(told), shm::monotonic_now());
  }
  for (const auto& [source, word] : last_.words) {
    paces_[source].look(word, last_.snapshot.table.timeout(source), last_.now);
  }
  // Else who wins is told by the next look.
  if (is_of_binding && last_.is_settled) take_seats();
  const shm::Nanoseconds over = shm::monotonic_now();
  const shm::Nanoseconds next =
      std::clamp(last_.next_end(), over + kLeastInterval, over + kLookInterval);
  return std::max(next, over + (over - began) * (kLookShare - 1));
}

void Sampler::take_seats() {
  if (census_ == nullptr) return;
  std::map<std::string, Seat> seats;
  std::vector<Takeover> noted = takeovers_;
  const std::uint64_t so_far = takeovers_so_far_;
  for (std::size_t i = 0; i < port_ids_.size(); ++i) {
    if (port_ids_[i] == shm::kNone) continue;
    const std::string& name = census_->ports[i].name;
    const auto known = seats_.find(name);
    if (known == seats_.end()) {
      seats[name] = first_seat(port_ids_[i]);
      continue;
    }
    Seat now = seat_at(port_ids_[i]);
    Seat before = known->second;
    for (const Accepted& each : arrivals_.fresh()) {
      if (each.port == name && now.is_arbitrated && each.at <= last_.now)
        follow(name, before, each);
    }
    if (now.winner != before.winner) {
      note_takeover(name, port_ids_[i], before, now);
    } else {
      now.since = before.since;
      now.is_exact = before.is_exact;
    }
    seats[name] = now;
  }
  if (memory_->tables().is_whole(last_.snapshot)) {
    seats_ = std::move(seats);
    arrivals_.drop_until(last_.now);
  } else {  // what was read of the table may have been another's
    takeovers_ = std::move(noted);
    takeovers_so_far_ = so_far;
  }
}

Sampler::Seat Sampler::seat_at(shm::PortId port) const {
  Seat seat;
  seat.generation = last_.snapshot.generation;
  if (seat.generation == 0) return seat;
  seat.is_arbitrated = last_.snapshot.table.is_arbitrated(port);
  seat.winner = last_.winner_at(port);
  return seat;
}

// Of the past, what the activity words tell: exact only while the first model is in force, for they
// were written under its T.
Sampler::Seat Sampler::first_seat(shm::PortId port) const {
  Seat seat = seat_at(port);
  seat.since = started_;
  if (!seat.is_arbitrated || census_->first_model_since == 0) return seat;
  const auto word = [this](shm::SourceId source) {
    const auto found = last_.words.find(source);
    return found == last_.words.end() ? shm::kNeverActive : found->second;
  };
  const auto began = [this](shm::SourceId source) { return last_.beginning_of(source); };
  const rules::Tenure tenure =
      rules::tenure_of(last_.snapshot.table, port, seat.winner,
                       {last_.now, census_->first_model_since, word, {}, began});
  seat.since = std::max(tenure.at_least, census_->first_model_since);
  seat.is_exact = tenure.is_exact();
  return seat;
}

// One that came before what is known already tells nothing new, and so does one that an earlier
// model accepted. What a later model than that of the picture accepted, the next look tells.
void Sampler::follow(const std::string& port, Seat& seat, const Accepted& accepted) {
  const auto source = instance_->find_source(accepted.source);
  if (!source || accepted.at < seat.since || accepted.generation < seat.generation ||
      accepted.generation > last_.snapshot.generation) {
    return;
  }
  // Whether the winner of before would have won without the arrival is not known: the model is
  // named.
  const bool is_of_another =
      std::exchange(seat.generation, accepted.generation) != accepted.generation;
  if (*source == seat.winner) return;
  add_takeover(port, seat.winner, *source, accepted.at,
               is_of_another ? came_into_force(accepted.generation) : accepted.source + " arrived");
  seat = {*source, true, accepted.generation, accepted.at, true};
}

void Sampler::note_takeover(const std::string& port, shm::PortId id, const Seat& before,
                            Seat& now) {
  now.since = last_.now;
  now.is_exact = true;
  std::string because = cause_of(id, before.generation, now.since);
  add_takeover(port, before.winner, now.winner, now.since, std::move(because));
}

void Sampler::add_takeover(const std::string& port, shm::SourceId before, shm::SourceId winner,
                           shm::Nanoseconds at, std::string because) {
  Takeover takeover;
  takeover.number = ++takeovers_so_far_;
  takeover.at = at;
  takeover.wall = earlier(wall_, last_.now - at);
  takeover.port = port;
  takeover.before = name_of(before);
  takeover.winner = name_of(winner);
  takeover.because = std::move(because);
  takeovers_.push_back(std::move(takeover));
}

// `at`: when it happened, which was before it was seen.
std::string Sampler::cause_of(shm::PortId port, std::uint64_t generation_before,
                              shm::Nanoseconds& at) const {
  if (generation_before != last_.snapshot.generation) {
    return came_into_force(last_.snapshot.generation);
  }
  const shm::TableView& table = last_.snapshot.table;
  const auto was = [this](shm::SourceId source) { return before_.is_active(source); };
  const auto is = [this](shm::SourceId source) { return last_.is_active(source); };
  const auto causes = rules::causes_of_change(table, port, was, is);
  at = last_.selected_since(before_, port);
  std::string text;
  for (const shm::SourceId source : causes) {
    // A table that is not whole may name any source: take_seats() forgets what is said of that.
    const auto found = last_.words.find(source);
    if (found == last_.words.end()) continue;
    const bool has_expired = shm::is_finite(found->second) && !is(source);
    text += (text.empty() ? "" : ", ") + name_of(source) +
            (is(source)    ? " became active"
             : has_expired ? " went inactive"
                           : " was deactivated");
  }
  return text;
}

std::string Sampler::name_of(shm::SourceId source) const {
  return source == shm::kNone ? "" : memory_->source_name(source);
}

std::shared_ptr<const Frame> Sampler::frame(
    const std::map<std::string, std::optional<Waits>>& tapped) const {
  if (census_ == nullptr || memory_ == nullptr) return nullptr;
  const auto frame = std::make_shared<Frame>();
  frame->now = last_.now;
  frame->wall = wall_;
  frame->census = census_;
  frame->generation = last_.snapshot.generation;
  frame->memories = memories_;
  frame->takeovers = takeovers_so_far_;
  frame->has_daemon = instance_->has_daemon();
  frame->is_counted = last_.now - census_->at < kCensusHolds;
  frame->is_settled = last_.is_settled;
  for (const PortFact& each : census_->ports) {
    PortState& state = frame->ports.emplace_back();
    if (const auto found = tapped.find(each.name); found != tapped.end()) {
      state.is_tapped = true;
      state.oldest = arrivals_.oldest_at(each, *census_);
      state.waits = found->second;
    }
    const auto seat = seats_.find(each.name);
    if (seat == seats_.end()) continue;
    state.since = seat->second.since;
    state.is_exact = seat->second.is_exact;
    const auto place = places_.find(seat->second.winner);
    if (!seat->second.is_arbitrated) {
      state.winner = kNotArbitrated;
    } else if (seat->second.winner == shm::kNone) {
      state.winner = kNobody;
    } else if (place != places_.end()) {
      state.winner = place->second;
    }
  }
  for (std::size_t i = 0; i < census_->sources.size(); ++i) {
    const bool is_bound = i < source_ids_.size() && source_ids_[i] != shm::kNone;
    const auto word = is_bound ? last_.words.find(source_ids_[i]) : last_.words.end();
    frame->words.push_back(word == last_.words.end() ? shm::kNeverActive : word->second);
    const auto pace = is_bound ? paces_.find(source_ids_[i]) : paces_.end();
    const auto period = pace == paces_.end() ? std::nullopt : pace->second.slow_period();
    frame->slow_periods.push_back(period.value_or(0));
  }
  return frame;
}

}  // namespace arbiter::top
