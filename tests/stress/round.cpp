#include "tests/stress/round.hpp"

#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <stdexcept>

#include "shm/table_ring.hpp"
#include "tests/stress/components.hpp"

namespace arbiter::stress {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr double kRoundSeconds = 2;
// Whoever hangs for so long hangs for ever.
constexpr std::int64_t kPatience = 60 * kSecond;
// So many steps of all others show that nobody hinders them.
constexpr std::uint64_t kAdvance = 500;

class Deadline {
 public:
  explicit Deadline(std::string what) : what_(std::move(what)) {}
  // Throws once patience is at its end.
  void wait() const {
    usleep(200);
    if (read_clock() - start_ > kPatience) throw std::runtime_error("in vain: " + what_);
  }

 private:
  std::string what_;
  std::int64_t start_ = read_clock();
};

}  // namespace

void Distribution::add(std::uint64_t nanoseconds) {
  Pauses one{};
  one.add(static_cast<std::int64_t>(nanoseconds));
  add(one);
}

void Distribution::add(const Pauses& pauses) {
  longest = std::max(longest, pauses.longest.load());
  for (std::size_t i = 0; i < buckets.size(); ++i) buckets[i] += pauses.buckets[i].load();
}

std::uint64_t Distribution::count() const {
  std::uint64_t sum = 0;
  for (const std::uint64_t bucket : buckets) sum += bucket;
  return sum;
}

std::uint64_t Distribution::quantile(double share) const {
  const auto wanted = static_cast<double>(count()) * share;
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < buckets.size(); ++i) {
    sum += buckets[i];
    if (static_cast<double>(sum) >= wanted) return std::min(std::uint64_t{1} << i, longest);
  }
  return longest;
}

Round::Round(const Options& options, const Plan& plan, Records& records, Totals& totals)
    : options_(options),
      plan_(plan),
      records_(records),
      totals_(totals),
      daemon_(plan.model_text(0)),
      accounts_(plan, records),
      random_(plan.seed ^ 0x5eed),
      swaps_{{0, 0, 0}},
      processes_(plan.components.size()),
      incarnations_(plan.components.size()),
      killed_at_(plan.components.size()),
      troubled_(plan.components.size()) {
  records_.reset();
  meet_daemon();
}

// After a failure too: nothing is left behind.
Round::~Round() {
  records_.begin(kEnd);
  for (auto& thread : threads_) thread.join();
  for (const pid_t process : processes_) {
    if (process <= 0) continue;
    kill(process, SIGCONT);
    if (records_.has_failed()) kill(process, SIGKILL);
    int status = 0;
    waitpid(process, &status, 0);
    if (status != 0) records_.fail("a component ended with status " + std::to_string(status));
  }
}

void Round::meet_daemon() {
  client_ = std::make_unique<test::RawClient>(daemon_.instance());
  const wire::Received welcome = client_->hello("stress");
  board_ = shm::Mapping(welcome.descriptors[0], sizeof(shm::Board), shm::Access::kReadOnly);
}

PortIds Round::port_ids() {
  PortIds ids;
  client_->send(test::RawClient::message(wire::MessageKind::kObserve));
  wire::Received received;
  while (client_->receive(received) && received.message.kind != wire::MessageKind::kDone) {
    if (received.message.kind == wire::MessageKind::kPortName) {
      ids[std::string(received.message.name_view())] = received.message.id;
    }
  }
  return ids;
}

void Round::start(std::uint32_t component) {
  const std::uint32_t incarnation = ++incarnations_[component];
  const auto run = [this, component, incarnation] {
    try {
      run_component(plan_, records_, component, incarnation);
    } catch (const std::exception& error) {
      records_.fail(std::string("a component: ") + error.what());
    }
  };
  if (options_.threads) {
    threads_.emplace_back(run);
    return;
  }
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() == parent) run();
    _exit(0);
  }
  processes_[component] = child;
}

bool Round::is_open(std::uint32_t component) const {
  return records_.components[component].incarnation.load(std::memory_order_acquire) ==
         incarnations_[component];
}

void Round::wait_until_open(std::uint32_t component) {
  const Deadline deadline("component " + std::to_string(component) + " should open its ports");
  while (!is_open(component) && !records_.has_failed()) deadline.wait();
}

bool Round::is_full() const {
  const auto full = [](const auto& log) { return log.size() > log.kEnough; };
  return std::any_of(std::begin(records_.arrivals), std::end(records_.arrivals), full) ||
         std::any_of(std::begin(records_.seen), std::end(records_.seen), full) ||
         std::any_of(std::begin(records_.takings), std::end(records_.takings), full);
}

void Round::run(std::uint64_t kills, std::uint64_t stops, bool kill_the_daemon) {
  for (std::uint32_t i = 0; i < plan_.components.size(); ++i) start(i);
  for (std::uint32_t i = 0; i < plan_.components.size(); ++i) {
    wait_until_open(i);
    if (!options_.threads) accounts_.watch(i, processes_[i]);
  }
  port_ids_ = port_ids();
  records_.begin(kRunning);
  work(kills, stops, kill_the_daemon);
  for (std::uint32_t i = 0; i < plan_.components.size(); ++i) wait_until_open(i);
  note_takeovers();
  for (const Phase phase : {kPublishersStop, kRelaysStop, kReceiversStop}) {
    records_.begin(phase);
    wait_for_all_done(phase);
  }
  if (!records_.has_failed()) check();
  add_up();
}

void Round::work(std::uint64_t kills, std::uint64_t stops, bool kill_the_daemon) {
  const std::int64_t begin = read_clock();
  // A round with kills lasts for as many as its records have room for.
  const double seconds = kills != 0 ? 10 : std::min(kRoundSeconds, options_.seconds);
  const auto until = begin + static_cast<std::int64_t>(seconds * kSecond);
  if (kill_the_daemon && options_.keep_daemon_dead) kill_daemon();
  for (; stops != 0 && !is_full() && !records_.has_failed(); --stops) stop_one();
  const bool swaps = options_.swaps && daemon_lives_ && random_.one_in(2);
  while (read_clock() < until && !is_full() && !records_.has_failed()) {
    if (swaps && (kills == 0 || random_.one_in(8))) swap_model();
    if (kill_the_daemon && daemon_lives_ && totals_.daemon_kills < options_.daemon_kills) {
      replace_daemon();
    }
    if (kills != 0) {
      if (kill_one() && --kills == 0) break;
      usleep(50 + random_.below(500));
    } else {
      usleep(100);
    }
  }
}

void Round::swap_model() {
  const shm::TableReader tables(*board_.as<const shm::Board>());
  const std::uint64_t before = tables.snapshot().generation;
  const std::uint32_t model = 1 - swaps_.back().model;
  daemon_.write_model(plan_.model_text(model));
  const std::int64_t begin = read_clock();
  daemon_.hang_up();
  const Deadline deadline("a model should be in force");
  while (tables.snapshot().generation == before) deadline.wait();
  swaps_.push_back({begin, read_clock(), model});
  ++totals_.swaps;
}

// Any but the first receiver, whose accounts span all publishers.
bool Round::kill_one() {
  note_takeovers();
  const auto victim = 1 + random_.below(static_cast<std::uint32_t>(plan_.components.size()) - 1);
  if (!is_open(victim) || killed_at_[victim] != 0) return false;
  kill(processes_[victim], SIGKILL);
  killed_at_[victim] = read_clock();
  waitpid(processes_[victim], nullptr, 0);
  processes_[victim] = 0;
  troubled_[victim] = true;
  ++totals_.kills;
  const ComponentPlan& what = plan_.components[victim];
  ++(what.watches != kNobody  ? totals_.killed_taps
     : what.port == kNobody   ? totals_.killed_publishers
     : what.source == kNobody ? totals_.killed_receivers
                              : totals_.killed_relays);
  start(victim);
  return true;
}

void Round::note_takeovers() {
  for (std::uint32_t i = 0; i < killed_at_.size(); ++i) {
    if (killed_at_[i] == 0 || !is_open(i)) continue;
    const std::int64_t opened = records_.components[i].opened_at.load();
    totals_.takeovers.add(static_cast<std::uint64_t>(opened - killed_at_[i]));
    killed_at_[i] = 0;
    accounts_.watch(i, processes_[i]);
  }
}

void Round::wait_for_steps(std::uint64_t count, std::uint32_t of_all_but) const {
  std::vector<std::uint64_t> before;
  for (std::uint32_t i = 0; i < plan_.components.size(); ++i) {
    before.push_back(records_.components[i].steps.load());
  }
  const Deadline deadline("everybody should advance");
  for (std::uint32_t i = 0; i < plan_.components.size(); ++i) {
    const ComponentState& state = records_.components[i];
    while (i != of_all_but && state.steps.load() < before[i] + count && !is_full()) {
      if (records_.has_failed()) return;
      deadline.wait();
    }
  }
}

void Round::stop_one() {
  const auto victim = random_.below(static_cast<std::uint32_t>(plan_.components.size()));
  const std::int64_t until =
      read_clock() + static_cast<std::int64_t>(options_.stop_seconds * kSecond);
  usleep(random_.below(2'000));
  kill(processes_[victim], SIGSTOP);
  waitpid(processes_[victim], nullptr, WUNTRACED);
  troubled_[victim] = true;
  wait_for_steps(kAdvance, victim);
  while (read_clock() < until && !records_.has_failed()) {
    usleep(10'000);
  }
  kill(processes_[victim], SIGCONT);
  wait_for_steps(kAdvance, kNobody);
  ++totals_.stops;
}

void Round::kill_daemon() {
  wait_for_steps(kAdvance, kNobody);
  daemon_.kill();
  daemon_lives_ = false;
  ++totals_.daemon_kills;
  wait_for_steps(kAdvance, kNobody);
}

// All flows go on without a daemon; then another takes over, whose status must list all ports, and
// which puts the model that it is given in force: the same.
void Round::replace_daemon() {
  const std::uint64_t generation =
      shm::TableReader(*board_.as<const shm::Board>()).snapshot().generation;
  kill_daemon();
  const std::int64_t begin = read_clock();
  daemon_.restart();
  daemon_lives_ = true;
  meet_daemon();
  const Deadline deadline("the new daemon should know all ports");
  while (!has_all_ports(daemon_.status())) deadline.wait();
  totals_.readoptions.add(static_cast<std::uint64_t>(read_clock() - begin));
  const Deadline swap("the new daemon's model should be in force");
  const shm::TableReader tables(*board_.as<const shm::Board>());  // mapped again by meet_daemon()
  while (tables.snapshot().generation == generation) swap.wait();
  wait_for_steps(kAdvance, kNobody);
}

bool Round::has_all_ports(const nlohmann::json& status) const {
  const auto open = [](const nlohmann::json& ports) {
    return static_cast<std::size_t>(std::count_if(
        ports.begin(), ports.end(), [](const auto& port) { return port["open"] == true; }));
  };
  return open(status["sources"]) == plan_.sources.size() &&
         open(status["inputs"]) == plan_.ports.size();
}

void Round::wait_for_all_done(Phase phase) {
  const Deadline deadline("everybody should come to the end of phase " + std::to_string(phase));
  for (std::uint32_t i = 0; i < plan_.components.size(); ++i) {
    const ComponentPlan& what = plan_.components[i];
    const Phase its = what.watches != kNobody  ? kReceiversStop
                      : what.port == kNobody   ? kPublishersStop
                      : what.source == kNobody ? kReceiversStop
                                               : kRelaysStop;
    while (its == phase && records_.components[i].done.load() != phase) {
      if (records_.has_failed()) return;
      deadline.wait();
    }
  }
}

void Round::check() {
  History history(plan_, records_, swaps_);
  const bool all_open = std::none_of(incarnations_.begin(), incarnations_.end(),
                                     [](std::uint32_t count) { return count != 1; });
  const Checked checked = history.check(all_open);
  if (!options_.threads && checked.too_few > accounts_.undecided()) {
    records_.fail(std::to_string(checked.too_few) +
                  " arrivals were discarded where they surely won; " +
                  std::to_string(accounts_.undecided()) + " decisions could not be taken");
  }
  const TapsChecked taps = check_taps(plan_, records_);
  totals_.taps.events += taps.events;
  totals_.taps.lost += taps.lost;
  totals_.checked.arrivals += checked.arrivals;
  totals_.checked.takes += checked.takes;
  totals_.checked.hard_takes += checked.hard_takes;
  totals_.checked.too_few += checked.too_few;
  check_accounts();
}

// What a publisher has left behind is taken when the daemon has told of its death: it may take a
// moment until all is counted.
void Round::check_accounts() {
  const bool all_open = std::none_of(incarnations_.begin(), incarnations_.end(),
                                     [](std::uint32_t count) { return count != 1; });
  const std::int64_t until = read_clock() + 10 * kSecond;
  std::vector<std::string> errors;
  do {
    errors.clear();
    if (!options_.threads) errors = accounts_.errors_in_segments(port_ids_);
    if (daemon_lives_) {
      const auto more = accounts_.errors_in_status(daemon_.status(), all_open);
      errors.insert(errors.end(), more.begin(), more.end());
    }
    if (errors.empty()) return;
    usleep(10'000);
  } while (read_clock() < until);
  for (const std::string& error : errors) records_.fail("the accounts do not balance: " + error);
}

void Round::add_up() {
  ++totals_.rounds;
  const bool trouble = std::any_of(troubled_.begin(), troubled_.end(), [](bool is) { return is; });
  for (std::uint32_t i = 0; i < plan_.components.size(); ++i) {
    totals_.steps += records_.components[i].steps.load();
    if (troubled_[i]) continue;
    (trouble ? totals_.pauses_in_trouble : totals_.pauses).add(records_.components[i].pauses);
  }
}

}  // namespace arbiter::stress
