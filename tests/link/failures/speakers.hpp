// One source, open on several hosts: each host obeys its own; any other one keeps the speaker that
// it has until that one is gone.
#pragma once

#include "tests/link/failures/checker.hpp"
#include "tests/link/failures/history.hpp"

namespace arbiter::failures {

void check_speakers(const HostEvidence& host, unsigned number, const History& history,
                    Findings& found, Checked& checked);

// A speaker that was obeyed at this host went although nothing befell it, or could not be heard any
// more, and another one was there all the time: how long after that the other one was heard.
struct Succession {
  Span when;  // from when the first one went until the other one must be heard
  unsigned from = 0;
  unsigned to = 0;
  Recovery recovery;
};
[[nodiscard]] std::vector<Succession> successions(const HostEvidence& host, unsigned number,
                                                  const History& history);

}  // namespace arbiter::failures
