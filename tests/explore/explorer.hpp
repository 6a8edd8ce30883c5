// Explores interleavings: runs a small concurrent scenario again and again, each time in another
// order, until all orders within some bounds have been seen.
//
// The code under test is the real one, compiled over atomics that come here (atomics.hpp). Threads
// are coroutines of one thread, so that a run is a list of choices, and can be replayed. The search
// is depth first over these choices:
//   - before each operation on a word that several threads use: which thread goes on. Taking the
//     turn from a thread that could go on costs one of `preemptions`; stopping it for ever, as a
//     kill does, costs one of `halts`;
//   - at each load: which of the values that it may see. Any but the newest costs one of
//     `stale_reads`.
//
// Of executions that differ only in the order of operations that have nothing to do with each
// other, not all are run to their end. A thread that was stopped before an operation could as well
// have been stopped after it if no other has touched the same words meanwhile; then this execution
// is left, for that other one is seen as well: it has the same operations with the same outcome,
// and costs no more (Explorer::end_step()).
//
// The memory is that of C++: each word has a history of stores, and each thread a view, the oldest
// store of each word that it may still see. A release store carries its thread's view along, an
// acquire load takes it up; fences as the standard has them. It contains all that x86 does with its
// store buffers, and what weaker machines do, except that a load never sees a store that comes
// after it in a cycle. Plain data (Plain<T>, payloads) has no history: two unordered accesses are
// an error.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <source_location>
#include <string>
#include <vector>

#include <boost/context/detail/fcontext.hpp>

#include "tests/explore/view.hpp"

namespace arbiter::explore {

struct Limits {
  int preemptions = 2;
  int stale_reads = 1;
  int halts = 0;  // of threads that may die
  std::uint64_t executions = 20'000'000;
  bool leaves_redundant = true;  // executions; false: to see what that leaves out
};

// What an operation loses when it is weakened: it becomes relaxed, or a fence nothing.
enum class Weakness : std::uint8_t { kAcquire, kRelease, kFence };

// An order in the source, as it can be left out.
struct Location {
  std::string file;
  std::uint32_t line = 0;
  std::uint32_t column = 0;
  Weakness kind = Weakness::kFence;

  auto operator<=>(const Location&) const = default;
};

struct Report {
  std::uint64_t executions = 0;
  bool complete = false;
  std::string failure;  // empty: none
  std::string trace;    // of the execution that failed: what each thread did, line by line
};

// One run of a scenario: its threads, and what must hold at the end.
class Execution {
 public:
  void thread(std::function<void()> body) { threads_.push_back({std::move(body), false}); }
  // One that may be stopped for ever before any of its operations.
  void mortal_thread(std::function<void()> body) { threads_.push_back({std::move(body), true}); }
  void finally(std::function<void()> check) { finally_ = std::move(check); }

 private:
  friend class Explorer;
  struct Body {
    std::function<void()> run;
    bool mortal;
  };
  std::vector<Body> threads_;
  std::function<void()> finally_ = [] {};
};

class Explorer {
 public:
  using Scenario = std::function<void(Execution&)>;
  using Where = std::source_location;

  explicit Explorer(Limits limits) : limits_(limits) {}
  Report run(const Scenario& scenario);

  void weaken(const Location& location) { weakening_ = &location; }
  // Collects what could be weakened.
  void collect(std::set<Location>& met) { met_ = &met; }

  // Null outside of a thread of a scenario: then atomics are plain words.
  static Explorer* current() noexcept { return current_; }
  static Explorer* running() noexcept { return running_; }

  // Operations of the thread that runs; `bits` is the word's value, newest at `address`.
  std::uint64_t load(const void* address, std::uint64_t bits, std::memory_order order,
                     const Where& where);
  void store(const void* address, std::uint64_t before, std::uint64_t bits, std::memory_order order,
             const Where& where);
  // The newest value, and the right to replace it at once by update().
  std::uint64_t begin_update(const void* address, std::uint64_t bits, std::memory_order order,
                             const Where& where);
  void update(const void* address, std::uint64_t bits, std::memory_order order, const Where& where);
  void full_fence(const Where& where);
  void acquire_fence(const Where& where);
  void release_fence(const Where& where);
  void read_plain(const void* address, const Where& where = Where::current());
  void write_plain(const void* address, const Where& where = Where::current());

  // The thread goes on only once `ready` holds. If none can go on, time passes until the first
  // deadline; without one, that is a failure.
  void wait_until(std::function<bool()> ready, std::int64_t deadline = INT64_MAX);
  // The thread goes on once another has ended, and knows all that it did, as if the kernel told it.
  void wait_for_end_of(std::size_t thread);
  [[nodiscard]] bool is_halted(std::size_t thread) const { return threads_[thread]->halted; }
  void fail(const std::string& what);

  // While it is positive no turn is taken from the thread that runs.
  int uninterrupted = 0;

 private:
  // Boost.Context's own: its public classes unwind the stack of a thread that is left for good.
  using Context = boost::context::detail::fcontext_t;
  struct Store {
    std::uint64_t bits = 0;
    View view;
  };
  // A word, or plain data. What is of one execution is void in the next.
  struct Word {
    const void* address = nullptr;
    std::uint64_t execution = 0;
    std::uint32_t readers = 0, writers = 0;  // bits by thread
    // By thread, the moment at which it has last read or written it.
    std::uint32_t read_at[View::kThreads] = {}, written_at[View::kThreads] = {};
    bool shared = false;  // several threads use it, one of them writing: learned on the way
    std::uint32_t index = 0;
    std::vector<std::uint32_t> history;  // in stores_
    // Plain data: by thread, its time at its last read; the last write.
    std::uint32_t reads[View::kThreads] = {};
    std::size_t writer = 0;
    std::uint32_t write = 0;

    void begin_history() noexcept {
      std::fill_n(read_at, View::kThreads, 0);
      std::fill_n(written_at, View::kThreads, 0);
      history.clear();
    }
  };
  struct Thread {
    Context context = nullptr;  // while it does not run
    std::function<void()> body;
    std::function<bool()> ready;
    std::int64_t deadline = INT64_MAX;
    bool mortal = false;
    bool finished = false;
    bool halted = false;
    View view, acquired, released;
    // The moment at which its turn was taken, while it does again what it was about to do then, and
    // nothing that it does has to do with what others have done since; otherwise 0.
    std::uint32_t stopped_at = 0;
    std::uint32_t waits_before = 0;
  };
  struct Choice {
    std::uint32_t taken;
    std::uint32_t count;
  };

  void run_once(const Scenario& scenario);
  void add_thread(std::size_t index, Execution::Body body);
  static void enter(boost::context::detail::transfer_t from);
  // Goes on at `to`; what runs now goes on from `from` when somebody jumps there.
  static void jump(Context to, Context& from);
  bool next_path();
  std::uint32_t choose(std::uint32_t count);
  void take_turns();
  void give_turn_to(std::size_t thread);
  void touch(Word& word, bool writes);
  void end_step();
  [[nodiscard]] bool is_anybody_waiting() const;
  bool can_run(std::size_t thread) const;
  [[nodiscard]] std::uint32_t find_others(std::size_t* others) const;
  void resume_another();
  bool pass_time();
  void switch_to(std::size_t thread);
  [[noreturn]] void leave();
  Word& find(const void* address);
  Word& find_plain(const void* address);
  void rehash();
  // Of a word that is shared; null for one that is not: it needs no history.
  Word* visit(const void* address, bool writes, std::uint64_t bits);
  bool is_weak(Weakness kind, const Where& where);
  void trace(const char* what, const void* address, std::uint64_t bits, const Where& where);
  void append(Word& to, std::uint64_t bits, bool release, const View* inherited);
  Thread& self() { return *threads_[active_]; }

  static inline Explorer* current_ = nullptr;
  static inline Explorer* running_ = nullptr;
  static constexpr std::size_t kStackSize = 256 * 1024;
  static constexpr std::uint32_t kMaxOperations = 200'000;

  const Limits limits_;
  const Location* weakening_ = nullptr;
  std::set<Location>* met_ = nullptr;
  Report report_;

  // Of the search.
  std::vector<Choice> path_;
  struct Entry {
    const void* address = nullptr;
    std::uint32_t word = 0;  // in words_
  };
  std::vector<Entry> table_;  // by hash of the address; its size is a power of two
  std::vector<Word> words_;
  bool learned_ = false;  // that another word is shared
  std::uint64_t execution_ = 0;

  // Of the execution under way.
  std::size_t step_ = 0;
  int preemptions_ = 0;
  int stale_reads_ = 0;
  int halts_ = 0;
  std::uint32_t operations_ = 0;
  std::uint32_t moment_ = 0;  // how often a turn was taken
  std::uint32_t waits_ = 0;   // how often a thread began to wait
  Word fences_;               // as if each full fence wrote it
  std::vector<std::unique_ptr<Thread>> threads_;
  std::size_t thread_count_ = 0;
  std::size_t active_ = 0;
  Context main_ = nullptr;
  std::vector<Store> stores_;
  std::uint32_t store_count_ = 0;
  std::uint32_t shared_count_ = 0;
  View fence_view_;  // of all full fences so far
  bool abandoned_ = false;
  bool tracing_ = false;
};

// Fails the execution under way unless it holds.
void require(bool holds, const char* what);
void wait_until(std::function<bool()> ready);
void wait_for_end_of(std::size_t thread);

// The thread is not interrupted in this scope: for what is long and of no interest, or stands for
// something that the kernel does.
class Uninterrupted {
 public:
  Uninterrupted() { change(1); }
  Uninterrupted(const Uninterrupted&) = delete;
  Uninterrupted& operator=(const Uninterrupted&) = delete;
  ~Uninterrupted() { change(-1); }

 private:
  static void change(int by) {
    if (Explorer* explorer = Explorer::current()) explorer->uninterrupted += by;
  }
};

// Data that no atomic protects: it must be ordered by those that do.
template <class T>
class Plain {
 public:
  Plain() = default;
  explicit Plain(T value) : value_(value) {}
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
