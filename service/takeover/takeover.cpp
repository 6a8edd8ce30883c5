#include "service/takeover/takeover.hpp"

#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <exception>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "service/kept/step.hpp"
#include "service/log/event.hpp"
#include "service/log/log.hpp"
#include "service/policy/headroom.hpp"
#include "shm/clock.hpp"

namespace arbiter::service {
namespace {

// How long the predecessor's components may take to come back before others are served.
constexpr shm::Nanoseconds kMaxWaitForReturn = 500'000'000;
// The same where none of them has handed back its memory yet, though one lives. Later they must
// start anew.
constexpr shm::Nanoseconds kMaxWaitForRealm = 2'000'000'000;
// How many components that have ended the state file may name.
constexpr std::size_t kMaxForgotten = 64;
// For want of room or of descriptors: when it is tried again to write the state file, or to watch
// an absentee.
constexpr shm::Nanoseconds kTryAgainAfter = 1'000'000'000;

void warn_of_lost_activity(const std::vector<std::string>& sources) {
  constexpr std::size_t kMostNamed = 16;
  if (sources.empty()) return;
  std::string names;
  for (std::size_t i = 0; i < std::min(sources.size(), kMostNamed); ++i) {
    names += (i == 0 ? "" : ", ") + sources[i];
  }
  if (sources.size() > kMostNamed) {
    names += " and " + std::to_string(sources.size() - kMostNamed) + " more";
  }
  log::warn("nobody has handed back the activity of {}: where it was to last for ever, it is over",
            names);
}

shm::FileDescriptor open_process(pid_t pid) {
  return shm::FileDescriptor(static_cast<int>(syscall(SYS_pidfd_open, pid, 0)));
}

// Empty where that cannot be told: what belongs to a process that may not be looked into is said to
// be root's.
std::optional<uid_t> user_of_process(pid_t pid) {
  struct stat status {};
  if (::stat(("/proc/" + std::to_string(pid)).c_str(), &status) != 0) return {};
  return status.st_uid == 0 ? std::nullopt : std::optional(status.st_uid);
}

}  // namespace

Takeover::Takeover(const Parts& parts, Host& host, StateFile state, bool stores)
    : gate_(parts.gate),
      shares_(parts.shares),
      registry_(parts.registry),
      names_(parts.names),
      board_(parts.board),
      switchboard_(parts.switchboard),
      clients_(parts.clients),
      host_(host),
      state_(std::move(state)),
      stores_(stores) {}

bool Takeover::may_inherit() {
  const auto state = state_.read();
  return (state && state->is_survived) || (stores_ && has_stored());
}

void Takeover::look_for_predecessor() {
  started_ = shm::monotonic_now();
  predecessor_ = state_.read();
  if (stores_ && inherit_stored()) return;
  if (predecessor_ && predecessor_->is_survived) {
    phase_ = Phase::kExpecting;
  } else {
    finish();
  }
}

// What the service manager has kept. False: nothing that is of use.
bool Takeover::inherit_stored() {
  const auto stored = take_stored();
  for (const StoredDescriptor& each : stored) stored_.push_back(each.name);
  const auto find = [&](const char* name) {
    return std::find_if(stored.begin(), stored.end(),
                        [&](const StoredDescriptor& each) { return each.name == name; });
  };
  const auto board = find("board");
  const auto registry = find("registry");
  if (board == stored.end() || registry == stored.end()) return false;
  try {
    inherit(board->descriptor, registry->descriptor);
  } catch (const std::exception& error) {
    log::warn("the memory kept by the service manager cannot be used: {}", error.what());
    return false;
  }
  for (const StoredDescriptor& each : stored) {
    if (&each != &*board && &each != &*registry) take_stored_page(each);
  }
  return true;
}

void Takeover::take_stored_page(const StoredDescriptor& stored) {
  try {
    if (!names_.take_stored_page(stored.name, stored.descriptor)) discard_stored(stored.name);
  } catch (const std::exception& error) {
    log::warn("{}, kept by the service manager, cannot be used: {}", stored.name, error.what());
  }
}

void Takeover::inherit(const shm::FileDescriptor& board, const shm::FileDescriptor& registry) {
  Registry inherited(registry);
  board_.inherit(board);
  registry_ = std::move(inherited);
  at_step("registry-taken-up");
  names_.restore(board_.in_use());
  at_step("names-restored");
  find_absentees();
  phase_ = Phase::kTakingOver;
  const auto generation = board_.in_force().generation;
  log_event({EventKind::kTakeover, {}, {}, {}, generation}, log::level::info,
            "taking over from the last daemon, {} components and model {}", absentees_.size(),
            generation);
}

void Takeover::find_absentees() {
  KeptPorts ended;
  for (const auto& source : names_.sources()) {
    if (source->away != 0) add_absentee(registry_.source(source->id).owner(), ended);
  }
  for (const auto& input : names_.inputs()) {
    if (input->away != 0) add_absentee(registry_.input(input->id).owner(), ended);
  }
  switchboard_.forget_away(ended);
  for (const auto& source : names_.sources()) {
    if (source->page_user) charge(*source->page_user, *source);
  }
  for (const auto& input : names_.inputs()) {
    if (input->away == 0) continue;
    const auto absentee = absentees_.find(registry_.input(input->id).owner().node);
    if (absentee == absentees_.end() || !absentee->second.user) continue;
    charge(*absentee->second.user, *input);
  }
}

void Takeover::charge(uid_t user, Source& source) {
  if (board_.in_force().table.knows_source(source.id)) return;
  shares_.pass_to(user, source.charge);
  shares_.pass_to(user, source.page_charge, left_for_absentees());
}

void Takeover::charge(uid_t user, InputName& input) {
  if (!board_.in_force().table.knows_port(input.id)) shares_.pass_to(user, input.charge);
}

Charge Takeover::charge_of_port(uid_t user, Charge kept, std::uint64_t descriptors) {
  if (!kept) {
    kept = shares_.take_own(Share::kDescriptors, descriptors);
    shares_.pass_to(user, kept, left_for_absentees());
  }
  return kept;
}

void Takeover::add_absentee(const Owner& owner, KeptPorts& ended) {
  const auto [found, is_new] = absentees_.try_emplace(owner.node);
  Absentee& absentee = found->second;
  if (is_new) {
    absentee.pid = owner.process.pid;
    absentee.started = owner.process.started;
    absentee.user = user_of_process(owner.process.pid);
    if (!open_and_watch(owner.node, absentee)) {
      absentees_.erase(owner.node);
      ended.try_emplace(owner.port);
      return;
    }
    // As it had it of the last daemon, whatever is left by now.
    absentee.charge = absentee.user && shares_.allows(*absentee.user, Share::kClients, 1)
                          ? shares_.take(*absentee.user, Share::kClients)
                          : shares_.take_own(Share::kClients);
  }
  absentee.ports.try_emplace(owner.port);
}

// For want of a descriptor it is tried again: what lives is not taken for what has ended.
bool Takeover::open_and_watch(NodeId node, Absentee& absentee) {
  absentee.process = open_process(absentee.pid);
  {
    const Headroom::Use use;  // to look at it
    const bool is_gone = Process{absentee.pid, absentee.started}.has_surely_ended();
    if (is_gone || has_ended(absentee.process)) return false;
  }
  try {
    if (absentee.process) host_.watch_absentee(absentee.process, node);
  } catch (const std::system_error&) {
    absentee.process.reset();
  }
  if (!absentee.process) {
    watch_again_at_ = std::min(watch_again_at_, shm::monotonic_now() + kTryAgainAfter);
  }
  return true;
}

void Takeover::watch_unwatched() {
  std::vector<NodeId> ended;
  for (auto& [node, absentee] : absentees_) {
    if (!absentee.process && absentee.started != 0 && !open_and_watch(node, absentee))
      ended.push_back(node);
  }
  for (const NodeId node : ended) forget_absentee(node);
}

// All who came in time are back, or never will be.
void Takeover::finish() {
  const bool is_fresh = phase_ != Phase::kTakingOver;
  remember_components();
  if (is_fresh) {
    if (phase_ == Phase::kExpecting) {
      log::warn("no component has handed back what the last daemon left");
    }
    store_realm();
  }
  phase_ = Phase::kServing;
  host_.try_postponed();
  replace_lost_pages();
  names_.forget_lost_pages(board_.in_force().table);
  at_step("about-to-serve");
  host_.begin_to_serve(is_fresh);
}

// In the place of another, where there is one: pages are stored as they are made or handed back.
void Takeover::store_realm() {
  if (!stores_) return;
  discard_stored("board");
  at_step("store-half-emptied");
  discard_stored("registry");
  // Or the next daemon would give up new pages with old ones of the same names.
  for (const std::string& page : std::exchange(stored_, {})) discard_stored(page);
  at_step("store-emptied");
  store("board", board_.writable());
  at_step("board-stored");
  store("registry", registry_.writable());
  at_step("registry-stored");
}

// The table in force goes on, perhaps for good: what it names by an id must stay what it was.
void Takeover::replace_lost_pages() {
  const auto table = board_.in_force().table;
  std::vector<std::string> lost;
  try {
    if (names_.replace_lost_pages(table, lost)) switchboard_.link_all(table);
  } catch (const std::system_error& error) {
    log::warn("not each source that was lost with the last daemon has an activity page again: {}",
              error.what());
  }
  warn_of_lost_activity(lost);
}

shm::Nanoseconds Takeover::deadline() const {
  return std::min({deadline_of_return(), write_again_at_, watch_again_at_});
}

shm::Nanoseconds Takeover::deadline_of_return() const {
  if (phase_ == Phase::kTakingOver) return started_ + kMaxWaitForReturn;
  if (phase_ == Phase::kExpecting && !waiting_.empty()) return started_ + kMaxWaitForRealm;
  return shm::kForever;
}

void Takeover::advance(shm::Nanoseconds now) {
  if (now >= watch_again_at_) {
    watch_again_at_ = shm::kForever;
    watch_unwatched();
  }
  if (now >= write_again_at_) remember_components();
  if (phase_ == Phase::kServing) return;
  const bool all_are_back = phase_ == Phase::kTakingOver && absentees_.empty() &&
                            std::none_of(clients_.begin(), clients_.end(), [](const auto& each) {
                              return each.second->is_returning;
                            });
  if (all_are_back || now >= deadline_of_return()) finish();
}

// Components that live on need the state file to come back by, as what the service manager keeps
// does.
void Takeover::leave_nothing_if_nobody_is_left() {
  if (!stores_ && is_over() && clients_.empty() && absentees_.empty()) state_.remove();
}

void Takeover::welcome_waiting() {
  for (const ClientId id : std::exchange(waiting_, {})) {
    if (Client* const client = clients_.find(id)) host_.welcome(*client);
  }
}

// For the next daemon. That it cannot be written keeps nobody from being served by this one.
void Takeover::remember_components() noexcept {
  const Headroom::Use use;
  try {
    std::vector<Process> components;
    for (const auto& [id, client] : clients_) {
      if (client->is_component) components.push_back(client->identity());
    }
    for (const auto& [node, absentee] : absentees_) {
      const auto started =
          absentee.started != 0 ? absentee.started : start_of_process(absentee.pid);
      components.push_back({absentee.pid, started});
    }
    state_.write({shm::identity_of(board_.readable()), shm::identity_of(registry_.readable())},
                 components);
    if (std::exchange(write_again_at_, shm::kForever) == shm::kForever) return;
    log::info("what the next daemon needs to take over is written down again");
  } catch (const std::exception& error) {
    log_unwritten(error.what());
  }
}

// Once until it is written.
void Takeover::log_unwritten(const std::string& why) {
  const bool is_news = write_again_at_ == shm::kForever;
  write_again_at_ = shm::monotonic_now() + kTryAgainAfter;
  if (!is_news) return;
  log::warn(
      "{}; should this daemon end before that can be written, {} must be restarted; it is "
      "tried again every second",
      why, state_.is_there() ? "components that have come since" : "all components");
}

void Takeover::remember_component(Client& client) {
  if (std::exchange(client.is_component, true)) return;
  if (!state_.is_there()) return;  // it is to be written yet, with all components
  const Headroom::Use use;
  try {
    state_.add(client.identity());
  } catch (const std::system_error& error) {
    log_unwritten(error.what());
    return;
  }
  const bool is_long = state_.size() > kMaxForgotten + 2 * (clients_.size() + absentees_.size());
  if (is_long && write_again_at_ == shm::kForever) remember_components();
}

}  // namespace arbiter::service
