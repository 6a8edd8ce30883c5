// All hosts are told to switch: what each of them did is what the operator was told, and nothing
// else puts a model in force.
#pragma once

#include "tests/link/failures/checker.hpp"
#include "tests/link/failures/history.hpp"

namespace arbiter::failures {

// `hosts`: all of them, by number - 1.
void check_switches(const std::vector<HostEvidence>& hosts, const History& history, Findings& found,
                    Checked& checked);

}  // namespace arbiter::failures
