// The switch between the hosts: passes on the frames of each to the others, and on the way loses,
// doubles and delays them, one way or both.
//
// Thread safety: any thread. It passes frames on on a thread of its own.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <queue>
#include <thread>
#include <utility>
#include <vector>

#include "shm/file_descriptor.hpp"
#include "tests/link/failures/time.hpp"
#include "tests/stress/sample.hpp"

namespace arbiter::failures {

// What becomes of frames on their way from one host to another.
struct Fault {
  bool is_cut = false;
  unsigned lost = 0;      // of 1000
  unsigned doubled = 0;   // of 1000
  unsigned delayed = 0;   // of 1000; those behind them overtake them
  Nanoseconds delay = 0;  // of these, at most
  bool is_even = false;   // all of them by the same time: none overtakes another
  bool operator==(const Fault&) const = default;
};

struct Passed {
  std::uint64_t frames = 0;
  std::uint64_t cut = 0;
  std::uint64_t lost = 0;
  std::uint64_t doubled = 0;
  std::uint64_t delayed = 0;
  std::uint64_t overtaken = 0;
};

class Relay {
 public:
  explicit Relay(std::uint64_t seed);
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;
  ~Relay();

  // The host's end of its cable; must stay open as long as the relay lives.
  void connect(unsigned host, int cable);
  // Once it has returned, frames fare like that: in a cut none comes out, whenever it went in.
  void set(unsigned from, unsigned to, const Fault& fault);
  [[nodiscard]] Passed passed() const;

 private:
  struct Late {
    Nanoseconds due = 0;
    std::uint64_t order = 0;
    unsigned from = 0;
    unsigned to = 0;
    std::vector<unsigned char> frame;
    bool operator<(const Late& other) const {  // the first to go is the largest
      return std::pair(due, order) > std::pair(other.due, other.order);
    }
  };
  void run();
  // Under the lock.
  void take_from(unsigned host, int cable);
  void send(unsigned from, unsigned to, const unsigned char* frame, std::size_t size);
  // `order`: by which frames came in.
  void deliver(unsigned from, unsigned to, std::uint64_t order, const unsigned char* frame,
               std::size_t size);
  int pass_late_ones();  // for how many ms there is nothing to do
  bool happens(unsigned of_1000) { return of_1000 != 0 && random_.below(1000) < of_1000; }

  mutable std::mutex mutex_;
  std::map<unsigned, int> cables_;
  std::map<std::pair<unsigned, unsigned>, Fault> faults_;
  std::priority_queue<Late> late_;
  std::uint64_t order_ = 0;
  // When the last frame came in, of those that came out.
  std::map<std::pair<unsigned, unsigned>, std::uint64_t> newest_;
  stress::Random random_;
  Passed passed_;
  bool ends_ = false;
  shm::FileDescriptor wake_;
  std::thread thread_;
};

}  // namespace arbiter::failures
