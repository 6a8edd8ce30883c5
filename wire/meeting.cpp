#include "wire/meeting.hpp"

#include <cstdio>

#include "shm/clock.hpp"

namespace arbiter::wire {

// The daemon read its clock after we had asked and before its answer came. All processors tell the
// same time, so one clock cannot say otherwise.
std::string find_fault_in_clock(const Message& welcome, shm::Nanoseconds asked) {
  const auto theirs = static_cast<shm::Nanoseconds>(welcome.peer);
  const shm::Nanoseconds now = shm::monotonic_now();
  if (theirs == 0 || (asked <= theirs && theirs <= now)) return {};
  const bool is_behind = theirs > now;
  const double seconds = static_cast<double>(is_behind ? theirs - now : asked - theirs) / 1e9;
  char text[256];
  std::snprintf(text, sizeof text,
                "the monotonic clock of this process is %.3f s %s the daemon's, so that its "
                "activity would %s: one of the two runs in a time namespace, as some containers "
                "do; run both in the same one",
                seconds, is_behind ? "behind" : "ahead of",
                is_behind ? "never be seen" : "not end in time");
  return text;
}

std::string describe_second_daemon(const std::string& instance, const std::string& met,
                                   const std::string& path) {
  return "there are two daemons of instance \"" + instance + "\", and components that meet at " +
         path + " share nothing with those that meet, as this one does, at " + met +
         ": an emergency stop published there stops nothing here; stop one of the two, or give it "
         "another --instance";
}

}  // namespace arbiter::wire
