// The explorer's memory: histories, views, fences, and plain data.
#include <algorithm>
#include <cstdio>
#include <string_view>

#include "tests/explore/explorer.hpp"
#include "tests/explore/image.hpp"

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

bool Explorer::is_weak(Weakness kind, const Where& where) {
  if (met_ != nullptr) met_->insert({where.file_name(), where.line(), where.column(), kind});
  return weakening_ != nullptr && weakening_->line == where.line() &&
         weakening_->column == where.column() && weakening_->kind == kind &&
         weakening_->file == where.file_name();
}

// Words are named in the order in which they are met first.
void Explorer::trace(const char* what, const void* address, std::uint64_t bits,
                     const Where& where) {
  if (!tracing_) return;
  const std::string_view file = where.file_name();
  char line[256];
  std::snprintf(
      line, sizeof line, "  thread %zu  %-8s %-28s word %-4td = %llx\n", active_, what,
      (std::string(file.substr(file.rfind('/') + 1)) + ":" + std::to_string(where.line())).c_str(),
      address == nullptr ? 0 : &find(address) - words_.data(),
      static_cast<unsigned long long>(bits));
  report_.trace += line;
}

std::uint64_t Explorer::load(const void* address, std::uint64_t bits, std::memory_order order,
                             const Where& where) {
  const Image::Outside outside;
  const bool takes = acquires(order) && !is_weak(Weakness::kAcquire, where);
  const Word* const from = visit(address, false, bits);
  if (from == nullptr) return bits;
  const auto newest = static_cast<std::uint32_t>(from->history.size() - 1);
  std::uint32_t age = 0;
  if (const std::uint32_t oldest = self().view.at(from->index);
      oldest < newest && stale_reads_ < limits_.stale_reads) {
    age = choose(newest - oldest + 1);
  }
  if (age != 0) ++stale_reads_;
  const Store& seen = stores_[from->history[newest - age]];
  self().view.set(from->index, newest - age);
  (takes ? self().view : self().acquired).join(seen.view);
  trace(age == 0 ? "load" : "load old", address, seen.bits, where);
  return seen.bits;
}

void Explorer::append(Word& to, std::uint64_t bits, bool release, const View* inherited) {
  const auto time = static_cast<std::uint32_t>(to.history.size());
  self().view.set(to.index, time);
  if (stores_.size() == store_count_) stores_.emplace_back();
  Store& store = stores_[store_count_];
  store.bits = bits;
  store.view = release ? self().view : self().released;
  if (inherited != nullptr) store.view.join(*inherited);
  store.view.set(to.index, time);
  to.history.push_back(store_count_++);
  // What the thread does from now on is not covered by what it has released so far.
  self().view.set(active_, self().view.at(active_) + 1);
}

void Explorer::store(const void* address, std::uint64_t before, std::uint64_t bits,
                     std::memory_order order, const Where& where) {
  const Image::Outside outside;
  const bool gives = releases(order) && !is_weak(Weakness::kRelease, where);
  if (Word* const word = visit(address, true, before)) {
    append(*word, bits, gives, nullptr);
    trace("store", address, bits, where);
  }
}

std::uint64_t Explorer::begin_update(const void* address, std::uint64_t bits,
                                     std::memory_order order, const Where& where) {
  const Image::Outside outside;
  const bool takes = acquires(order) && !is_weak(Weakness::kAcquire, where);
  const Word* const from = visit(address, true, bits);
  if (from == nullptr) return bits;
  self().view.set(from->index, static_cast<std::uint32_t>(from->history.size() - 1));
  const Store& seen = stores_[from->history.back()];
  (takes ? self().view : self().acquired).join(seen.view);
  return seen.bits;
}

void Explorer::update(const void* address, std::uint64_t bits, std::memory_order order,
                      const Where& where) {
  const Image::Outside outside;
  const bool gives = releases(order) && !is_weak(Weakness::kRelease, where);
  Word& word = find(address);
  if (word.history.empty()) return;  // it has none yet
  const View inherited = stores_[word.history.back()].view;
  append(word, bits, gives, &inherited);
  trace("update", address, bits, where);
}

void Explorer::full_fence(const Where& where) {
  const Image::Outside outside;
  if (is_weak(Weakness::kFence, where)) return;
  take_turns();
  touch(fences_, true);
  trace("fence", nullptr, 0, where);
  self().view.join(self().acquired);
  self().view.join(fence_view_);
  fence_view_ = self().released = self().view;
  self().view.set(active_, self().view.at(active_) + 1);
}

void Explorer::acquire_fence(const Where& where) {
  const Image::Outside outside;
  if (is_weak(Weakness::kFence, where)) return;
  self().view.join(self().acquired);
}

void Explorer::release_fence(const Where& where) {
  const Image::Outside outside;
  if (is_weak(Weakness::kFence, where)) return;
  self().released = self().view;
  self().view.set(active_, self().view.at(active_) + 1);
}

void Explorer::read_plain(const void* address, const Where& where) {
  const Image::Outside outside;
  trace("read", address, 0, where);
  Word& data = find_plain(address);
  touch(data, false);
  const View& view = self().view;
  if (data.write > view.at(data.writer)) fail("data was read that was still being written");
  data.reads[active_] = view.at(active_);
}

void Explorer::write_plain(const void* address, const Where& where) {
  const Image::Outside outside;
  trace("write", address, 0, where);
  Word& data = find_plain(address);
  touch(data, true);
  const View& view = self().view;
  for (std::size_t i = 0; i < thread_count_; ++i) {
    if (i != active_ && data.reads[i] > view.at(i)) {
      fail("data was written that was still being read");
    }
  }
  if (data.writer != active_ && data.write > view.at(data.writer)) {
    fail("data was written by two at once");
  }
  data.writer = active_;
  data.write = view.at(active_);
}

Explorer::Word& Explorer::find_plain(const void* address) {
  Word& data = find(address);
  if (data.execution != execution_) {
    data.execution = execution_;
    std::fill(std::begin(data.reads), std::end(data.reads), 0);
    std::fill_n(data.read_at, View::kThreads, 0);
    std::fill_n(data.written_at, View::kThreads, 0);
    data.writer = active_;
    data.write = 0;
  }
  return data;
}

}  // namespace arbiter::explore
