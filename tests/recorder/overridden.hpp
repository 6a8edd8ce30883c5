// A recording in which /high overrides /low for a while.
#pragma once

#include <string>

#include "tests/evidence/incident.hpp"

namespace arbiter::test {

// From 1000 on; the first arrival at 1100.
inline std::string overridden_for_a_while(Incident& incident) {
  incident.state("/high", 900, 995, shm::arrival(900, 150));  // until 1050
  incident.arrive("/low", 1100, 1101, Incident::Fate::accepted);
  incident.arrive("/high", 1200, 1201, Incident::Fate::accepted);
  for (const int time : {1300, 1310, 1320, 1330}) {
    incident.arrive("/low", time, time + 1, Incident::Fate::discarded);
  }
  incident.deactivate("/high", 1400, 1401);
  incident.arrive("/low", 1410, 1411, Incident::Fate::accepted);
  return incident.file();
}

}  // namespace arbiter::test
