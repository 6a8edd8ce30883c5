// Components that run under another daemon's memory, and that this one cannot take back: what it
// would know them by is lost. They go on among themselves, until they are restarted.
//
// Whoever is not taken back asks again every second, and says each time which ports it has. That is
// only what it says: it is told to people, and decides nothing.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <set>
#include <string>
#include <vector>

#include "service/clients/client.hpp"
#include "shm/activity.hpp"

namespace arbiter::service {

struct Stranger {
  Process process;
  uid_t user = 0;
  std::string node;
  std::string why;
  shm::Nanoseconds since = 0;  // when it was first refused
  shm::Nanoseconds seen = 0;   // and when it was last
  std::set<std::string> outputs, inputs;
};

class Strangers {
 public:
  // Then the user who has most of them gives way, and of these the one that was silent longest.
  static constexpr std::size_t kMax = 64;
  static constexpr std::size_t kMaxPorts = 64;  // of one of them, in each direction

  // A client has not been taken back. False: it is as it was the last time, and not worth telling.
  bool refuse(const Client& client, NodeId former, const std::string& why, shm::Nanoseconds now);
  // What such a client goes on to say, and that this was all of it.
  void has_output(const Client& client, const std::string& port);
  void has_input(const Client& client, const std::string& port);
  void has_said_all(const Client& client);
  // That component is known from now on, having begun anew.
  void welcome(const Client& client);

  // Those whose processes live.
  [[nodiscard]] std::vector<const Stranger*> living() const;

 private:
  struct Known {
    Stranger stranger;
    NodeId former = 0;
    ClientId conversation = 0;                // the last one
    std::set<std::string> outputs, inputs{};  // that it has said so far in it
  };

  [[nodiscard]] Known* find(const Client& client);
  void make_room();

  std::vector<Known> known_;
};

}  // namespace arbiter::service
