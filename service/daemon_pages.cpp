// How a source gets another page: when it passes to another user, and when an operator ends the
// activity that another user has left.
//
//   show    the next page to all whose ports read the source, and wait for them as for a swap
//   change  in one step: activity is carried on, and the next page is in force
// Who has not mapped it by then finds no page, and delivers nothing that depends on it. What the
// former owner writes after the change is read by nobody.
#include <unistd.h>

#include <exception>

#include "service/daemon.hpp"
#include "service/kept/step.hpp"
#include "service/log/event.hpp"
#include "service/log/log.hpp"
#include "shm/clock.hpp"

namespace arbiter::service {

void Daemon::require_not_changing(const Source& source) const {
  if (source.changing_for == 0) return;
  throw NotYet("the output port " + source.name + " is just passing to another user",
               shm::monotonic_now() + 2 * kMaxWaitForClients);
}

void Daemon::change_page(Source& source, const Client& client, std::uint64_t request, PageUser user,
                         std::function<void(Source&, Client&)> changed) {
  names_.prepare_page(source, user);
  source.changing_for = client.id();
  const auto pass = [this, id = source.id, user, for_client = client.id(), request,
                     changed = std::move(changed)] {
    Source& changing = *names_.source_by_id(id);
    if (changing.changing_for != for_client) return;
    changing.changing_for = 0;
    try_postponed_ = true;
    names_.let_go(changing);  // if nobody opens it after all
    Client* const asking = clients_.find(for_client);
    if (asking == nullptr) return;
    names_.change_page(changing, user);
    switchboard_.ring_concerned(board_.in_force().table, id);
    at_step("page-change-rung");
    try {
      changed(changing, *asking);
    } catch (const std::exception& error) {
      log_event({EventKind::kRefused, {asking->name}, {changing.name}}, log::level::warn, "{}: {}",
                asking->description(), error.what());
      refuse(*asking, request, error.what());
    }
  };
  const auto told = switchboard_.show_next_page(source);
  at_step("next-page-shown");
  barriers_.raise(told, shm::monotonic_now() + kMaxWaitForClients, pass);
}

bool Daemon::may_undo(const Source& source) const {
  return source.page_user && *source.page_user != 0 && *source.page_user != geteuid();
}

// True: the source was active.
bool Daemon::end_activity(const Source& source) {
  const shm::Nanoseconds now = shm::monotonic_now();
  shm::Activity& activity = source.activity();
  const shm::ActivityWord before = activity.word.load(std::memory_order_relaxed);
  // What is not active stays as it is: that it ran out, and when, or that it has never arrived.
  if (!shm::is_active(before, now)) return false;
  activity.deactivate(now);
  // SYNC POINT: stamped. Fence (a), as of a publisher's own deactivate().
  shm::full_fence();
  switchboard_.ring_concerned(board_.in_force().table, source.id);
  return true;
}

}  // namespace arbiter::service
