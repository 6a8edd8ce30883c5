#include "rules/explain/change.hpp"

#include "rules/explain/tenure.hpp"
#include "shm/port_picture.hpp"

namespace arbiter::rules {

std::vector<shm::SourceId> causes_of_change(const shm::TableView& table, shm::PortId port,
                                            const Picture& before, const Picture& after) {
  std::vector<shm::SourceId> changed;
  for (const shm::SourceId source : sources_heeded(table, port)) {
    if (before(source) != after(source)) changed.push_back(source);
  }
  const shm::SourceId now = shm::selected_at(table, port, after).source;
  for (const shm::SourceId source : changed) {
    const auto after_it_alone = [&](shm::SourceId each) {
      return each == source ? after(each) : before(each);
    };
    if (shm::selected_at(table, port, after_it_alone).source == now) return {source};
  }
  return changed;
}

}  // namespace arbiter::rules
