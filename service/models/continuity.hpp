// What of a model that comes into force was so before: since when a port is decided as it is, and
// which T a source had.
#pragma once

#include <map>
#include <string>

#include "rules/prove/compile.hpp"
#include "service/ports/port_names.hpp"
#include "shm/activity.hpp"
#include "shm/decision_table.hpp"

namespace arbiter::service {

class Continuity {
 public:
  struct PastTimeout {
    shm::Nanoseconds timeout = 0;  // T until then
    shm::Nanoseconds until = 0;
    shm::ActivityWord word = shm::kNeverActive;  // what its activity was then
  };

  // The ports of `after` whose rules, and whose sources' T, are those of `before` (null: not known)
  // keep the time they have, `before_since` at the latest; all others begin anew.
  void change(const rules::CompiledModel* before, const rules::CompiledModel& after,
              shm::Nanoseconds before_since);
  // Remembers of each source the T that it had, where that was another. Of a source to which
  // nothing has happened since an earlier change it stays the T of then, which its last arrival
  // came under.
  void change_timeouts(const PortNames& names, const shm::TableView& before,
                       const shm::TableView& after, shm::Nanoseconds now);

  // Of the ports that some earlier model decided as the one in force does: since when.
  [[nodiscard]] const std::map<std::string, shm::Nanoseconds>& ports() const { return ports_; }
  // Of the sources whose T has changed, when it last did.
  [[nodiscard]] const std::map<std::string, PastTimeout>& timeouts() const { return timeouts_; }

 private:
  std::map<std::string, shm::Nanoseconds> ports_;
  std::map<std::string, PastTimeout> timeouts_;
};

}  // namespace arbiter::service
