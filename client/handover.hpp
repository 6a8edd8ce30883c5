// How a port's surroundings pass from the service thread to the port's thread, and back for
// disposal.
//
// The service thread maps segments and builds a new view off the data path; the port's thread takes
// it at its next call, at the cost of one relaxed load where nothing has changed.
//
// Thread safety: one offering thread, one accepting thread.
#pragma once

#include <memory>
#include <utility>

#include "shm/atomic.hpp"

namespace arbiter::detail {

// View needs a member `View* next_retired`.
template <class View>
class Handover {
 public:
  Handover() = default;
  Handover(const Handover&) = delete;
  Handover& operator=(const Handover&) = delete;
  // Relaxed is enough: whoever ends this has seen the end of both threads.
  ~Handover() {
    delete offered_.load(std::memory_order_relaxed);
    collect();
  }

  // By the service thread. A view that was never accepted is replaced.
  // SYNC POINT: view-offered. Release, with the acquire in accept(): who takes a view sees it
  // whole. What comes back was our own offer: nothing to acquire.
  // True: the last view that was offered, if any, had been accepted.
  bool offer(std::unique_ptr<View> view) {
    const std::unique_ptr<View> last(offered_.exchange(view.release(), std::memory_order_release));
    collect();
    return last == nullptr;
  }

  // By the port's thread. Relaxed is enough to look: a view seen late is as one offered late.
  [[nodiscard]] bool has_offer() const noexcept {
    return offered_.load(std::memory_order_relaxed) != nullptr;
  }
  [[nodiscard]] std::unique_ptr<View> accept() noexcept {
    return std::unique_ptr<View>(offered_.exchange(nullptr, std::memory_order_acquire));
  }
  // Unmapping takes long: it is left to the service thread.
  // SYNC POINT: view-retired. Release, with the acquire in collect(): our last use comes before.
  void retire(std::unique_ptr<View> view) noexcept {
    if (view == nullptr) return;
    View* const raw = view.release();
    raw->next_retired = retired_.load(std::memory_order_relaxed);
    while (!retired_.compare_exchange_weak(raw->next_retired, raw, std::memory_order_release,
                                           std::memory_order_relaxed)) {
    }
  }
  void collect() noexcept {
    View* view = retired_.exchange(nullptr, std::memory_order_acquire);
    while (view != nullptr) delete std::exchange(view, view->next_retired);
  }

 private:
  shm::Atomic<View*> offered_{nullptr};
  shm::Atomic<View*> retired_{nullptr};
};

}  // namespace arbiter::detail
