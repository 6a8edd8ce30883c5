// What this link knows of hosts, as the hosts document says it.
#pragma once

#include "link/core/disagreements.hpp"
#include "link/core/host_card.hpp"
#include "link/core/questions.hpp"
#include "wire/hosts.hpp"

namespace arbiter::link {

// But for what its card does not say: whether it is up, since when, its round trip.
[[nodiscard]] wire::HostStatus status_of(const HostCard& card);
[[nodiscard]] wire::HostDisagreement status_of(const Disagreement& disagreement);
[[nodiscard]] wire::HostOutcome outcome_of(OpenQuestions::Outcome outcome);

}  // namespace arbiter::link
