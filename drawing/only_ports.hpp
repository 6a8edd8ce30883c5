// A part of a model, to be drawn by itself.
#pragma once

#include <set>
#include <string>

#include "rules/model/load.hpp"

namespace arbiter::drawing {

// What decides at these input ports: the behaviours that configure one of them and those whose
// activity silences such a one there, with the boxes around them; of connections, those to them.
rules::LoadedModel only_ports(const rules::LoadedModel& model, const std::set<std::string>& ports);

}  // namespace arbiter::drawing
