// What made a port select another source than before.
#pragma once

#include <functional>
#include <vector>

#include "shm/decision_table.hpp"

namespace arbiter::rules {

using Picture = std::function<bool(shm::SourceId)>;  // is it active?

// The sources whose change between two pictures made `table` select another one at the port: a
// single one where that alone would have done, else all that changed and that the port heeds. Empty
// where none has changed.
std::vector<shm::SourceId> causes_of_change(const shm::TableView& table, shm::PortId port,
                                            const Picture& before, const Picture& after);

}  // namespace arbiter::rules
