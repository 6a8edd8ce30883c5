#include "wire/errands.hpp"

#include <pthread.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#include "shm/clock.hpp"

namespace arbiter::wire {
namespace {

using Errand = std::function<void()>;

// Signals are for the loop: a thread that is made now inherits that it has them blocked.
class SignalsBlocked {
 public:
  SignalsBlocked() noexcept {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, &before_);
  }
  SignalsBlocked(const SignalsBlocked&) = delete;
  SignalsBlocked& operator=(const SignalsBlocked&) = delete;
  ~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

 private:
  sigset_t before_;
};

}  // namespace

struct Errands::State : std::enable_shared_from_this<State> {
  // One thread's turn. Whoever it works for looks at `since` to see whether it is lost.
  struct Turn {
    shm::Nanoseconds since = 0;  // when its errand began
    bool lost = false;
  };

  struct Lane {
    std::deque<Errand> waiting;
    std::vector<std::shared_ptr<Turn>> turns;  // of threads that work for this user, lost ones too

    [[nodiscard]] std::size_t lost() const {
      return static_cast<std::size_t>(
          std::count_if(turns.begin(), turns.end(), [](const auto& turn) { return turn->lost; }));
    }
    [[nodiscard]] bool needs_a_thread() const {
      return !waiting.empty() && turns.size() == lost() && lost() < Errands::kMaxLostOfAUser;
    }
  };

  mutable std::mutex mutex;
  mutable std::condition_variable news;
  std::map<uid_t, Lane> lanes;  // those that have something to do
  std::size_t threads = 0;

  void work(uid_t user, const std::shared_ptr<Turn>& turn);
  void start_threads();
  void start(uid_t user, Lane& lane);
};

// Of a thread of this user, until nothing waits, or another has taken its place.
void Errands::State::work(uid_t user, const std::shared_ptr<Turn>& turn) {
  std::unique_lock lock(mutex);
  Lane& lane = lanes[user];
  while (!lane.waiting.empty() && !turn->lost) {
    Errand errand = std::move(lane.waiting.front());
    lane.waiting.pop_front();
    turn->since = shm::monotonic_now();
    lock.unlock();
    errand();
    errand = nullptr;
    lock.lock();
  }
  lane.turns.erase(std::find(lane.turns.begin(), lane.turns.end(), turn));
  --threads;
  if (lane.turns.empty() && lane.waiting.empty()) lanes.erase(user);
  start_threads();
  news.notify_all();
}

void Errands::State::start_threads() {
  for (auto& [user, lane] : lanes) {
    if (threads == kMaxThreads) return;
    if (lane.needs_a_thread()) start(user, lane);
  }
}

// Without a thread to be had it is tried again with the next errand, or when one ends.
void Errands::State::start(uid_t user, Lane& lane) {
  auto turn = std::make_shared<Turn>();
  turn->since = shm::monotonic_now();
  const SignalsBlocked blocked;
  try {
    std::thread([state = shared_from_this(), user, turn] {
      pthread_setname_np(pthread_self(), "errands");
      state->work(user, turn);
    }).detach();
  } catch (const std::system_error&) {
    return;
  }
  lane.turns.push_back(std::move(turn));
  ++threads;
}

Errands& Errands::of_the_process() {
  static auto* const errands = new Errands();  // threads may outlive main()
  return *errands;
}

Errands::Errands() : state_(std::make_shared<State>()) {}
Errands::~Errands() = default;

void Errands::run(uid_t user, std::function<void()> errand) {
  const std::lock_guard lock(state_->mutex);
  State::Lane& lane = state_->lanes[user];
  lane.waiting.push_back(std::move(errand));
  if (lane.needs_a_thread() && state_->threads < kMaxThreads) state_->start(user, lane);
}

void Errands::close(uid_t user, shm::FileDescriptor descriptor) {
  if (!descriptor) return;
  // std::function is copied, so what it holds must be.
  run(user,
      [shared = std::make_shared<shm::FileDescriptor>(std::move(descriptor))] { shared->reset(); });
}

std::string Errands::look_after(shm::Nanoseconds now) {
  std::string said;
  const std::lock_guard lock(state_->mutex);
  for (auto& [user, lane] : state_->lanes) {
    for (const auto& turn : lane.turns) {
      if (turn->lost || now - turn->since < kOverdue) continue;
      turn->lost = true;
      said += (said.empty() ? "" : "; ") + std::string("a descriptor of user ") +
              std::to_string(user) + " keeps a thread waiting for more than 1 s (" +
              std::to_string(lane.lost()) + " of " + std::to_string(kMaxLostOfAUser) +
              " that one user may keep), " + std::to_string(lane.waiting.size()) +
              " of its others wait";
    }
  }
  if (!said.empty()) state_->start_threads();
  return said;
}

shm::Nanoseconds Errands::deadline() const {
  shm::Nanoseconds first = shm::kForever;
  const std::lock_guard lock(state_->mutex);
  for (const auto& [user, lane] : state_->lanes) {
    for (const auto& turn : lane.turns) {
      if (!turn->lost) first = std::min(first, turn->since + kOverdue);
    }
  }
  return first;
}

bool Errands::is_stuck(uid_t user) const {
  const std::lock_guard lock(state_->mutex);
  const auto lane = state_->lanes.find(user);
  if (lane == state_->lanes.end()) return false;
  const std::size_t waiting = lane->second.waiting.size();
  return waiting >= kMostWaiting ||
         (waiting >= kMaxWaiting && lane->second.lost() == kMaxLostOfAUser);
}

std::size_t Errands::lost() const {
  const std::lock_guard lock(state_->mutex);
  std::size_t count = 0;
  for (const auto& [user, lane] : state_->lanes) count += lane.lost();
  return count;
}

bool Errands::wait_until_done(shm::Nanoseconds limit) const {
  std::unique_lock lock(state_->mutex);
  return state_->news.wait_for(lock, std::chrono::nanoseconds(limit),
                               [&] { return state_->lanes.empty(); });
}

}  // namespace arbiter::wire
