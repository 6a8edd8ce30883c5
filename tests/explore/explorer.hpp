// Explores interleavings: runs a small concurrent scenario again and again, each time in another
// order, until all orders within some bounds have been seen.
//
// The code under test is the real one, compiled over atomics that come here (atomics.hpp). Threads
// are coroutines of one thread, so that a run is a list of choices, and can be replayed. The search
// is depth first over these choices:
//   - before each operation on a word that several threads use: which thread goes on. Taking the
//     turn from a thread that could go on costs one of `preemptions`;
//   - at each load: which of the values that it may see. Any but the newest costs one of
//     `stale_reads`.
//
// The memory is that of C++: each word has a history of stores, and each thread a view, the oldest
// store of each word that it may still see. A release store carries its thread's view along, an
// acquire load takes it up; fences as the standard has them. It contains all that x86 does with its
// store buffers, and what weaker machines do, except that a load never sees a store that comes
// after it in a cycle. Plain data (Plain<T>) has no history: two unordered accesses are an error.
#pragma once

#include <ucontext.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <source_location>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

namespace arbiter::explore {

struct Limits {
  int preemptions = 2;
  int stale_reads = 1;
  std::uint64_t executions = 5'000'000;
};

enum class Weakness { kFullFence, kAcquireFence, kReleaseFence, kAcquire, kRelease };

// Which order is to be left out, to see that the test would notice: that of `kind` in functions
// whose name contains `function`.
struct Weakening {
  Weakness kind;
  std::string function;
};

struct Report {
  std::uint64_t executions = 0;
  bool complete = false;
  bool weakened = false;  // the order to be left out was met
  std::string failure;    // empty: none
};

// One run of a scenario: set it up, name its threads and what must hold at the end.
class Execution {
 public:
  void thread(std::function<void()> body) { threads_.push_back(std::move(body)); }
  void finally(std::function<void()> check) { finally_ = std::move(check); }

 private:
  friend class Explorer;
  std::vector<std::function<void()>> threads_;
  std::function<void()> finally_ = [] {};
};

class Explorer {
 public:
  using Scenario = std::function<void(Execution&)>;

  explicit Explorer(Limits limits) : limits_(limits) {}
  Report run(const Scenario& scenario);
  Report run(const Scenario& scenario, Weakening weakening);

  // Null outside of a thread of a scenario: then atomics are plain words.
  static Explorer* current() noexcept { return current_; }
  static Explorer* running() noexcept { return running_; }

  // Operations of the thread that runs; `bits` is the word's value, newest at `address`.
  std::uint64_t load(const void* address, std::uint64_t bits, std::memory_order order,
                     const std::source_location& where);
  void store(const void* address, std::uint64_t before, std::uint64_t bits, std::memory_order order,
             const std::source_location& where);
  // The newest value, and the right to replace it at once by update().
  std::uint64_t begin_update(const void* address, std::uint64_t bits, std::memory_order order,
                             const std::source_location& where);
  void update(const void* address, std::uint64_t bits, std::memory_order order,
              const std::source_location& where);
  void full_fence(const std::source_location& where);
  void acquire_fence(const std::source_location& where);
  void release_fence(const std::source_location& where);
  void read_plain(const void* address);
  void write_plain(const void* address);

  // The thread goes on only once `ready` holds. If none can go on, that is a failure.
  void wait_until(std::function<bool()> ready);
  void fail(const std::string& what);

 private:
  using View = std::vector<std::uint32_t>;  // by word; what is beyond its end is 0
  struct Store {
    std::uint64_t bits;
    View view;
  };
  struct Word {
    std::vector<Store> history;
  };
  struct PlainState {
    std::vector<std::uint32_t> reads;  // by thread: its time then
    std::size_t writer = 0;
    std::uint32_t write = 0;
  };
  struct Thread {
    ucontext_t context;
    std::function<void()> body;
    std::function<bool()> ready;
    bool finished = false;
    View view, acquired, released;
  };
  struct Choice {
    std::uint32_t taken;
    std::uint32_t count;
  };

  void run_once(const Scenario& scenario);
  void add_thread(std::function<void()> body);
  static void enter(unsigned index);
  bool next_path();
  std::uint32_t choose(std::uint32_t count);
  void point(const void* address, bool writes);
  bool can_run(std::size_t thread) const;
  void resume_another();
  void switch_to(std::size_t thread);
  void leave();
  Word& word(const void* address, std::uint64_t bits, std::size_t& index);
  bool is_weak(Weakness kind, const std::source_location& where);
  void append(std::size_t index, std::uint64_t bits, bool release, const View* inherited);
  void advance_clock();
  static void join(View& into, const View& from);
  static std::uint32_t at(const View& view, std::size_t index) {
    return index < view.size() ? view[index] : 0;
  }
  static void set(View& view, std::size_t index, std::uint32_t time) {
    if (index >= view.size()) view.resize(index + 1, 0);
    view[index] = time;
  }

  static inline Explorer* current_ = nullptr;
  static inline Explorer* running_ = nullptr;
  static constexpr std::size_t kStackSize = 256 * 1024;
  static constexpr std::size_t kMaxThreads = 4;

  const Limits limits_;
  const Weakening* weakening_ = nullptr;
  Report report_;

  // Of the search.
  std::vector<Choice> path_;
  std::unordered_set<const void*> shared_;  // words that several threads use, one of them writing
  std::unordered_set<const void*> newly_shared_;

  // Of the execution under way.
  std::size_t step_ = 0;
  int preemptions_ = 0;
  int stale_reads_ = 0;
  std::vector<std::unique_ptr<Thread>> threads_;
  std::size_t active_ = 0;
  ucontext_t main_;
  std::vector<Word> words_;
  std::unordered_map<const void*, std::size_t> index_of_;
  std::unordered_map<const void*, PlainState> plain_;
  struct Users {
    std::uint32_t readers = 0, writers = 0;  // bits by thread
  };
  std::unordered_map<const void*, Users> users_;
  View fence_view_;  // of all full fences so far
  bool abandoned_ = false;
};

// Fails the execution under way unless it holds.
void require(bool holds, const std::string& what);
void wait_until(std::function<bool()> ready);

// Data that no atomic protects: it must be ordered by those that do.
template <class T>
class Plain {
 public:
  Plain() = default;
  T read() const {
    if (Explorer* explorer = Explorer::current()) explorer->read_plain(this);
    return value_;
  }
  void write(T value) {
    if (Explorer* explorer = Explorer::current()) explorer->write_plain(this);
    value_ = value;
  }

 private:
  T value_{};
};

}  // namespace arbiter::explore
