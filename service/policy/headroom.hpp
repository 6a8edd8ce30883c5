// Descriptors that are kept free for those that a message may bring.
//
// Where a process has no descriptor left, the kernel closes what it cannot hand over before
// recvmsg() returns: a stranger's descriptor, on our thread. So the daemon lives under a lower
// limit than it was given, and raises it for as long as it receives.
#pragma once

#include <sys/resource.h>

namespace arbiter::service {

class Headroom {
 public:
  // The process's, from the limit that it has when this is first asked for.
  static const Headroom& of_the_process();

  // Descriptors below this number are ours to use.
  [[nodiscard]] rlim_t limit() const { return lowered_; }
  // Whether a message can bring all that a message can carry.
  [[nodiscard]] bool is_enough() const;

  // While it lives, the rest may be used too.
  class Use {
   public:
    Use();
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;
    ~Use();
  };

 private:
  Headroom();
  static void set(rlim_t limit);

  rlim_t whole_ = RLIM_INFINITY;
  rlim_t lowered_ = RLIM_INFINITY;
};

}  // namespace arbiter::service
