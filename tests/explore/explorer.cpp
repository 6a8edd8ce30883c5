#include "tests/explore/explorer.hpp"

#include <algorithm>
#include <stdexcept>

namespace arbiter::explore {
namespace {

bool acquires(std::memory_order order) {
  return order == std::memory_order_acquire || order == std::memory_order_acq_rel ||
         order == std::memory_order_seq_cst;
}
bool releases(std::memory_order order) {
  return order == std::memory_order_release || order == std::memory_order_acq_rel ||
         order == std::memory_order_seq_cst;
}

}  // namespace

Report Explorer::run(const Scenario& scenario) {
  report_ = {};
  shared_.clear();
  newly_shared_.clear();
  path_.clear();
  bool search_again = false;
  do {
    run_once(scenario);
    ++report_.executions;
    if (!report_.failure.empty() || report_.executions == limits_.executions) return report_;
    // Which words are shared is learned on the way; the search begins again with each.
    if (!newly_shared_.empty()) {
      shared_.merge(newly_shared_);
      path_.clear();
      search_again = true;
    } else {
      search_again = next_path();
    }
  } while (search_again);
  report_.complete = true;
  return report_;
}

Report Explorer::run(const Scenario& scenario, Weakening weakening) {
  weakening_ = &weakening;
  Report report = run(scenario);
  weakening_ = nullptr;
  return report;
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
  Choice& choice = path_[step_++];
  if (choice.count != count) throw std::logic_error("the scenario is not deterministic");
  return choice.taken;
}

void Explorer::run_once(const Scenario& scenario) {
  Execution execution;
  scenario(execution);
  if (execution.threads_.size() > kMaxThreads) throw std::logic_error("too many threads");
  step_ = 0;
  preemptions_ = stale_reads_ = 0;
  words_.clear();
  index_of_.clear();
  plain_.clear();
  users_.clear();
  fence_view_.clear();
  abandoned_ = false;
  // The first words are the threads' own clocks, by which plain data is ordered.
  words_.resize(kMaxThreads);
  running_ = this;
  threads_.clear();
  for (auto& body : execution.threads_) add_thread(std::move(body));
  active_ = choose(static_cast<std::uint32_t>(threads_.size()));
  current_ = this;
  swapcontext(&main_, &threads_[active_]->context);
  current_ = nullptr;
  if (!abandoned_) execution.finally_();
  running_ = nullptr;
}

void Explorer::add_thread(std::function<void()> body) {
  static std::vector<std::unique_ptr<std::byte[]>> stacks;
  const std::size_t index = threads_.size();
  if (stacks.size() == index) stacks.push_back(std::make_unique<std::byte[]>(kStackSize));
  auto thread = std::make_unique<Thread>();
  thread->body = std::move(body);
  set(thread->view, index, 1);
  getcontext(&thread->context);
  thread->context.uc_stack.ss_sp = stacks[index].get();
  thread->context.uc_stack.ss_size = kStackSize;
  thread->context.uc_link = nullptr;
  makecontext(&thread->context, reinterpret_cast<void (*)()>(&Explorer::enter), 1,
              static_cast<unsigned>(index));
  threads_.push_back(std::move(thread));
}

void Explorer::enter(unsigned index) {
  Explorer& explorer = *running_;
  explorer.threads_[index]->body();
  explorer.threads_[index]->finished = true;
  explorer.resume_another();
}

bool Explorer::can_run(std::size_t thread) const {
  const Thread& candidate = *threads_[thread];
  return !candidate.finished && (!candidate.ready || candidate.ready());
}

// The active thread has finished, or has to wait.
void Explorer::resume_another() {
  std::vector<std::size_t> candidates;
  bool all_finished = true;
  current_ = nullptr;  // what they wait for is looked up as it stands
  for (std::size_t i = 0; i < threads_.size(); ++i) {
    all_finished = all_finished && threads_[i]->finished;
    if (can_run(i)) candidates.push_back(i);
  }
  current_ = this;
  if (candidates.empty()) {
    if (!all_finished) fail("nobody can go on: a wake-up was lost");
    leave();
  }
  const std::size_t next = candidates[choose(static_cast<std::uint32_t>(candidates.size()))];
  if (next != active_) switch_to(next);
}

void Explorer::switch_to(std::size_t thread) {
  const std::size_t before = active_;
  active_ = thread;
  swapcontext(&threads_[before]->context, &threads_[thread]->context);
}

void Explorer::leave() {
  current_ = nullptr;
  setcontext(&main_);
}

void Explorer::fail(const std::string& what) {
  if (report_.failure.empty()) {
    report_.failure = what + "; schedule:";
    for (std::size_t i = 0; i < step_; ++i) {
      report_.failure += " " + std::to_string(path_[i].taken);
    }
  }
  abandoned_ = true;
  if (current_ != nullptr) leave();
}

void Explorer::wait_until(std::function<bool()> ready) {
  Thread& self = *threads_[active_];
  self.ready = std::move(ready);
  resume_another();
  threads_[active_]->ready = nullptr;
}

// Before an operation: may another thread go first?
void Explorer::point(const void* address, bool writes) {
  if (address != nullptr) {
    Users& users = users_[address];
    (writes ? users.writers : users.readers) |= 1u << active_;
    const std::uint32_t all = users.readers | users.writers;
    const bool is_shared = users.writers != 0 && (all & (all - 1)) != 0;
    if (shared_.count(address) == 0) {
      if (is_shared) newly_shared_.insert(address);
      return;
    }
  }
  if (preemptions_ == limits_.preemptions) return;
  std::vector<std::size_t> candidates{active_};
  current_ = nullptr;
  for (std::size_t i = 0; i < threads_.size(); ++i) {
    if (i != active_ && can_run(i)) candidates.push_back(i);
  }
  current_ = this;
  const std::size_t next = candidates[choose(static_cast<std::uint32_t>(candidates.size()))];
  if (next == active_) return;
  ++preemptions_;
  switch_to(next);
}

Explorer::Word& Explorer::word(const void* address, std::uint64_t bits, std::size_t& index) {
  const auto [found, is_new] = index_of_.try_emplace(address, words_.size());
  index = found->second;
  if (is_new) words_.push_back({{{bits, {}}}});
  return words_[index];
}

bool Explorer::is_weak(Weakness kind, const std::source_location& where) {
  if (weakening_ == nullptr || weakening_->kind != kind) return false;
  if (std::string_view(where.function_name()).find(weakening_->function) ==
      std::string_view::npos) {
    return false;
  }
  report_.weakened = true;
  return true;
}

void Explorer::join(View& into, const View& from) {
  if (into.size() < from.size()) into.resize(from.size(), 0);
  for (std::size_t i = 0; i < from.size(); ++i) into[i] = std::max(into[i], from[i]);
}

std::uint64_t Explorer::load(const void* address, std::uint64_t bits, std::memory_order order,
                             const std::source_location& where) {
  point(address, false);
  std::size_t index = 0;
  Word& from = word(address, bits, index);
  Thread& self = *threads_[active_];
  const auto newest = static_cast<std::uint32_t>(from.history.size() - 1);
  std::uint32_t age = 0;
  if (const std::uint32_t oldest = at(self.view, index);
      oldest < newest && stale_reads_ < limits_.stale_reads) {
    age = choose(newest - oldest + 1);
  }
  if (age != 0) ++stale_reads_;
  const Store& seen = from.history[newest - age];
  set(self.view, index, newest - age);
  const bool takes = acquires(order) && !is_weak(Weakness::kAcquire, where);
  join(takes ? self.view : self.acquired, seen.view);
  return seen.bits;
}

void Explorer::append(std::size_t index, std::uint64_t bits, bool release, const View* inherited) {
  Thread& self = *threads_[active_];
  Word& to = words_[index];
  set(self.view, index, static_cast<std::uint32_t>(to.history.size()));
  View view = release ? self.view : self.released;
  if (inherited != nullptr) join(view, *inherited);
  set(view, index, static_cast<std::uint32_t>(to.history.size()));
  to.history.push_back({bits, std::move(view)});
}

void Explorer::store(const void* address, std::uint64_t before, std::uint64_t bits,
                     std::memory_order order, const std::source_location& where) {
  point(address, true);
  std::size_t index = 0;
  word(address, before, index);
  append(index, bits, releases(order) && !is_weak(Weakness::kRelease, where), nullptr);
  advance_clock();
}

std::uint64_t Explorer::begin_update(const void* address, std::uint64_t bits,
                                     std::memory_order order, const std::source_location& where) {
  point(address, true);
  std::size_t index = 0;
  const Word& from = word(address, bits, index);
  Thread& self = *threads_[active_];
  set(self.view, index, static_cast<std::uint32_t>(from.history.size() - 1));
  const bool takes = acquires(order) && !is_weak(Weakness::kAcquire, where);
  join(takes ? self.view : self.acquired, from.history.back().view);
  return from.history.back().bits;
}

void Explorer::update(const void* address, std::uint64_t bits, std::memory_order order,
                      const std::source_location& where) {
  const std::size_t index = index_of_.at(address);
  const View inherited = words_[index].history.back().view;
  append(index, bits, releases(order) && !is_weak(Weakness::kRelease, where), &inherited);
  advance_clock();
}

void Explorer::full_fence(const std::source_location& where) {
  if (is_weak(Weakness::kFullFence, where)) return;
  point(nullptr, true);
  Thread& self = *threads_[active_];
  join(self.view, self.acquired);
  join(self.view, fence_view_);
  fence_view_ = self.released = self.view;
  advance_clock();
}

void Explorer::acquire_fence(const std::source_location& where) {
  if (is_weak(Weakness::kAcquireFence, where)) return;
  Thread& self = *threads_[active_];
  join(self.view, self.acquired);
}

void Explorer::release_fence(const std::source_location& where) {
  if (is_weak(Weakness::kReleaseFence, where)) return;
  Thread& self = *threads_[active_];
  self.released = self.view;
  advance_clock();
}

// What a thread does from now on is not covered by what it has released so far.
void Explorer::advance_clock() {
  View& view = threads_[active_]->view;
  set(view, active_, at(view, active_) + 1);
}

void Explorer::read_plain(const void* address) {
  const View& view = threads_[active_]->view;
  PlainState& state = plain_[address];
  if (state.write > at(view, state.writer)) fail("data was read that was still being written");
  state.reads.resize(kMaxThreads, 0);
  state.reads[active_] = at(view, active_);
}

void Explorer::write_plain(const void* address) {
  const View& view = threads_[active_]->view;
  PlainState& state = plain_[address];
  state.reads.resize(kMaxThreads, 0);
  for (std::size_t i = 0; i < kMaxThreads; ++i) {
    if (i != active_ && state.reads[i] > at(view, i)) {
      fail("data was written that was still being read");
    }
  }
  if (state.writer != active_ && state.write > at(view, state.writer)) {
    fail("data was written by two at once");
  }
  state.writer = active_;
  state.write = at(view, active_);
}

void require(bool holds, const std::string& what) {
  if (holds) return;
  Explorer::running()->fail(what);
}

void wait_until(std::function<bool()> ready) { Explorer::current()->wait_until(std::move(ready)); }

}  // namespace arbiter::explore
