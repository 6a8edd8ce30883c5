#include "tests/explore/explorer.hpp"

#include <algorithm>
#include <bit>
#include <stdexcept>
#include <utility>

#include "tests/explore/image.hpp"
#include "tests/explore/kernel.hpp"

namespace arbiter::explore {
namespace {

std::size_t hash(const void* address) {
  return reinterpret_cast<std::uintptr_t>(address) * 0x9e3779b97f4a7c15u >> 40;
}

}  // namespace

Report Explorer::run(const Scenario& scenario) {
  report_ = {};
  path_.clear();
  words_.clear();
  rehash();
  bool search_again = false;
  do {
    learned_ = false;
    run_once(scenario);
    ++report_.executions;
    // Nothing is said of an execution in which a word had no history yet.
    if (learned_) report_.failure.clear();
    if (!report_.failure.empty()) {
      tracing_ = true;
      run_once(scenario);
      tracing_ = false;
      return report_;
    }
    if (report_.executions == limits_.executions) return report_;
    // Which words are shared is learned on the way; the search begins again with each.
    if (learned_) {
      path_.clear();
      report_.executions = 0;
      search_again = true;
    } else {
      search_again = next_path();
    }
  } while (search_again);
  report_.complete = true;
  return report_;
}

// The next path in depth-first order: the last choice that has an alternative left takes it.
bool Explorer::next_path() {
  while (!path_.empty() && path_.back().taken + 1 == path_.back().count) path_.pop_back();
  if (path_.empty()) return false;
  ++path_.back().taken;
  return true;
}

std::uint32_t Explorer::choose(std::uint32_t count) {
  if (count <= 1) return 0;
  if (step_ == path_.size()) path_.push_back({0, count});
  const Choice& choice = path_[step_++];
  if (choice.count != count) throw std::logic_error("the scenario is not deterministic");
  return choice.taken;
}

void Explorer::run_once(const Scenario& scenario) {
  Execution execution;
  running_ = this;
  scenario(execution);
  thread_count_ = execution.threads_.size();
  if (thread_count_ > View::kThreads) throw std::logic_error("too many threads");
  ++execution_;
  step_ = 0;
  preemptions_ = stale_reads_ = halts_ = uninterrupted = 0;
  operations_ = moment_ = waits_ = 0;
  fences_ = {};
  store_count_ = 0;
  shared_count_ = View::kThreads;
  fence_view_.clear();
  abandoned_ = false;
  for (std::size_t i = 0; i < thread_count_; ++i) add_thread(i, std::move(execution.threads_[i]));
  active_ = choose(static_cast<std::uint32_t>(thread_count_));
  current_ = this;
  jump(threads_[active_]->context, main_);
  current_ = nullptr;
  if (!abandoned_) {
    const Image::Inside inside;
    execution.finally_();
  }
  running_ = nullptr;
}

void Explorer::add_thread(std::size_t index, Execution::Body body) {
  static std::vector<std::unique_ptr<std::byte[]>> stacks;
  if (stacks.size() == index) stacks.push_back(std::make_unique<std::byte[]>(kStackSize));
  if (threads_.size() == index) threads_.push_back(std::make_unique<Thread>());
  Thread& thread = *threads_[index];
  thread.body = std::move(body.run);
  thread.mortal = body.mortal;
  thread.ready = nullptr;
  thread.finished = thread.halted = false;
  thread.stopped_at = 0;
  thread.view.clear();
  thread.acquired.clear();
  thread.released.clear();
  thread.view.set(index, 1);
  thread.context = boost::context::detail::make_fcontext(stacks[index].get() + kStackSize,
                                                         kStackSize, &Explorer::enter);
}

// Whoever goes on keeps, for the one it comes from, where that is to go on.
void Explorer::jump(Context to, Context& from) {
  const auto back = boost::context::detail::jump_fcontext(to, &from);
  *static_cast<Context*>(back.data) = back.fctx;
}

void Explorer::enter(boost::context::detail::transfer_t from) {
  *static_cast<Context*>(from.data) = from.fctx;
  Explorer& explorer = *running_;
  const std::size_t index = explorer.active_;
  {
    const Image::Inside inside;
    explorer.threads_[index]->body();
  }
  explorer.end_step();
  explorer.threads_[index]->finished = true;
  explorer.resume_another();
}

bool Explorer::can_run(std::size_t thread) const {
  const Thread& candidate = *threads_[thread];
  return !candidate.finished && !candidate.halted && (!candidate.ready || candidate.ready());
}

// Those that could go on but the active one. What they wait for is looked up as it stands.
std::uint32_t Explorer::find_others(std::size_t* others) const {
  std::uint32_t count = 0;
  Explorer* const before = std::exchange(current_, nullptr);
  for (std::size_t i = 0; i < thread_count_; ++i) {
    if (i != active_ && can_run(i)) others[count++] = i;
  }
  current_ = before;
  return count;
}

// The active thread has finished, is halted, or has to wait.
void Explorer::resume_another() {
  std::size_t candidates[View::kThreads + 1];
  std::uint32_t count = find_others(candidates);
  const auto self_can_run = [&] {
    Explorer* const before = std::exchange(current_, nullptr);
    const bool can = can_run(active_);
    current_ = before;
    return can;
  };
  if (self_can_run()) candidates[count++] = active_;
  while (count == 0) {
    if (!pass_time()) leave();
    count = find_others(candidates);
    if (self_can_run()) candidates[count++] = active_;
  }
  const std::size_t next = candidates[choose(count)];
  if (next != active_) switch_to(next);
}

// False: all have ended.
bool Explorer::pass_time() {
  std::int64_t first = INT64_MAX;
  bool all_ended = true;
  for (std::size_t i = 0; i < thread_count_; ++i) {
    const Thread& thread = *threads_[i];
    if (thread.finished || thread.halted) continue;
    all_ended = false;
    first = std::min(first, thread.deadline);
  }
  if (all_ended) return false;
  if (first == INT64_MAX) fail("nobody can go on: a wake-up was lost");
  set_virtual_time(first);
  return true;
}

void Explorer::switch_to(std::size_t thread) {
  const std::size_t before = active_;
  active_ = thread;
  jump(threads_[thread]->context, threads_[before]->context);
}

void Explorer::leave() {
  Image::leave();
  current_ = nullptr;
  jump(main_, self().context);
  throw std::logic_error("a thread goes on that was left for good");
}

void Explorer::fail(const std::string& what) {
  if (const Image::Outside outside; report_.failure.empty()) {
    report_.failure = what + "; schedule:";
    for (std::size_t i = 0; i < step_; ++i) {
      report_.failure += " " + std::to_string(path_[i].taken);
    }
  }
  abandoned_ = true;
  if (current_ != nullptr) leave();
}

void Explorer::wait_until(std::function<bool()> ready, std::int64_t deadline) {
  const Image::Outside outside;
  end_step();
  ++waits_;
  self().ready = std::move(ready);
  self().deadline = deadline;
  resume_another();
  self().ready = nullptr;
  self().deadline = INT64_MAX;
}

void Explorer::wait_for_end_of(std::size_t thread) {
  const Image::Outside outside;
  const Thread& other = *threads_[thread];
  wait_until([&other] { return other.finished || other.halted; });
  self().view.join(other.view);
}

// Before an operation: may another thread go first, or this one stop here for ever?
void Explorer::take_turns() {
  if (++operations_ == kMaxOperations) fail("it goes on for ever");
  if (uninterrupted != 0) return;
  end_step();
  std::size_t others[View::kThreads];
  std::uint32_t count = preemptions_ == limits_.preemptions ? 0 : find_others(others);
  const bool may_halt = self().mortal && halts_ != limits_.halts;
  const std::uint32_t chosen = choose(1 + count + (may_halt ? 1 : 0));
  if (chosen == 0) return;
  if (chosen <= count) {
    ++preemptions_;
    give_turn_to(others[chosen - 1]);
    return;
  }
  ++halts_;
  self().halted = true;
  resume_another();
}

void Explorer::give_turn_to(std::size_t thread) {
  Thread& stopped = self();
  const bool is_followed = limits_.leaves_redundant && !is_anybody_waiting();
  stopped.stopped_at = is_followed ? ++moment_ : 0;
  stopped.waits_before = waits_;
  switch_to(thread);
}

// What somebody waits for may be anything, and is not followed.
bool Explorer::is_anybody_waiting() const {
  for (std::size_t i = 0; i < thread_count_; ++i) {
    if (threads_[i]->ready) return true;
  }
  return false;
}

// The active thread reads or writes the word.
void Explorer::touch(Word& word, bool writes) {
  std::uint32_t& stopped_at = self().stopped_at;
  for (std::size_t i = 0; stopped_at != 0 && i < thread_count_; ++i) {
    if (i == active_) continue;
    if (word.written_at[i] >= stopped_at || (writes && word.read_at[i] >= stopped_at)) {
      stopped_at = 0;
    }
  }
  (writes ? word.written_at : word.read_at)[active_] = moment_;
}

// All up to the point where the active thread's turn may be taken again is done.
void Explorer::end_step() {
  Thread& thread = self();
  if (std::exchange(thread.stopped_at, 0) == 0 || thread.waits_before != waits_) return;
  // Nothing in it had to do with what others did since its turn was taken. An execution in which
  // its turn is taken only here has the same outcome, and is seen as well.
  abandoned_ = true;
  leave();
}

void Explorer::rehash() {
  const std::size_t size = std::bit_ceil(std::max<std::size_t>(1024, words_.size() * 8));
  table_.assign(size, {});
  for (std::size_t i = 0; i < words_.size(); ++i) {
    std::size_t at = hash(words_[i].address);
    while (table_[at & (size - 1)].address != nullptr) ++at;
    table_[at & (size - 1)] = {words_[i].address, static_cast<std::uint32_t>(i)};
  }
}

Explorer::Word& Explorer::find(const void* address) {
  const std::size_t mask = table_.size() - 1;
  std::size_t at = hash(address);
  for (;; ++at) {
    const Entry& entry = table_[at & mask];
    if (entry.address == address) return words_[entry.word];
    if (entry.address == nullptr) break;
  }
  table_[at & mask] = {address, static_cast<std::uint32_t>(words_.size())};
  words_.emplace_back().address = address;
  if (words_.size() * 4 > table_.size()) rehash();
  return words_.back();
}

Explorer::Word* Explorer::visit(const void* address, bool writes, std::uint64_t bits) {
  std::size_t at = static_cast<std::size_t>(&find(address) - words_.data());
  Word* word = &words_[at];
  if (word->execution != execution_) {
    word->execution = execution_;
    word->readers = word->writers = 0;
    if (word->shared) word->begin_history();
  }
  (writes ? word->writers : word->readers) |= 1u << active_;
  if (!word->shared) {
    const std::uint32_t all = word->readers | word->writers;
    word->shared = word->writers != 0 && (all & (all - 1)) != 0;
    if (word->shared) {
      learned_ = true;
      word->begin_history();
    }
    return nullptr;  // from its next visit on it has a history
  }
  take_turns();
  word = &words_[at];
  touch(*word, writes);
  if (word->history.empty()) {
    word->index = shared_count_++;
    if (stores_.size() == store_count_) stores_.emplace_back();
    Store& initial = stores_[store_count_];
    initial.bits = bits;
    initial.view.clear();
    word->history.push_back(store_count_++);
  }
  return word;
}

void require(bool holds, const char* what) {
  if (!holds) Explorer::running()->fail(what);
}

void wait_until(std::function<bool()> ready) { Explorer::current()->wait_until(std::move(ready)); }

void wait_for_end_of(std::size_t thread) { Explorer::current()->wait_for_end_of(thread); }

}  // namespace arbiter::explore
