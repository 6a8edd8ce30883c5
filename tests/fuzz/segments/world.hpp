// Ports without a daemon, put together by hand: honest ones, and a publisher and a receiver whose
// memory is not to be trusted.
//
//   /r   takes from /p while /s is not active, from /h while it is
//   /r2  takes from /p while /h is not active, else from /h
//   /x   takes from /p
//
// and taps, once watch() has been called:
//
//   t    watches /p, /h, and what /x takes
//   y    watches /p
//
// /h, /x and y are hostile. They run the honest code too, so that they get far; what others see of
// their memory is the fuzzer's.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "client/input/input_core.hpp"
#include "client/output/output_core.hpp"
#include "client/tap/tap_core.hpp"
#include "shm/table_ring.hpp"

namespace arbiter::fuzz {

// A word of a header, of 32 bits, that is not what it should be.
struct Patch {
  std::uint8_t word;
  std::uint32_t value;
};

inline constexpr std::uint64_t kSampleWords = 8;

// Fails the run, loudly, with what is wrong.
[[noreturn]] void die(const std::string& what);

struct Choices {
  std::uint32_t depth = 2;
  bool refuse_new = false;
  bool timeouts = false;  // finite ones
};

class World {
 private:
  // Before the ports that use them.
  static const shm::FileDescriptor& board_for(const Choices& choices);
  static shm::FileDescriptor make_board(const Choices& choices);
  static shm::FileDescriptor make_page(bool hostile);
  void require_account_of(const detail::InputCore& port, std::uint32_t id) const;
  static shm::FileDescriptor make_hostile(std::size_t size, const void* header,
                                          std::size_t header_size,
                                          const std::vector<Patch>& patches,
                                          const std::map<std::size_t, std::uint64_t>& words = {},
                                          bool is_allocated = false);
  std::shared_ptr<detail::SharedMemory> make_memory();

  const shm::FileDescriptor& board_;
  shm::FileDescriptor pages_[3];
  std::shared_ptr<detail::SharedMemory> honest_;
  std::shared_ptr<detail::SharedMemory> hostile_;

 public:
  explicit World(const Choices& choices);

  detail::OutputCore p;
  detail::OutputCore s;
  detail::OutputCore h;
  detail::InputCore r;
  detail::InputCore r2;
  detail::InputCore x;
  detail::TapCore t;
  detail::TapCore y;

  // As the daemon does it; each time under another number.
  void connect(detail::OutputCore& from, detail::InputCore& to);
  void disconnect(detail::OutputCore& from, detail::InputCore& to);
  // An output port, to /r, or an input port, to /p, whose segment is as it should be, but for some
  // words of its header; and an output's has as many bytes more or less as it says.
  void introduce_output(std::uint32_t slots, int more, const std::vector<Patch>& patches);
  void introduce_input(const std::vector<Patch>& patches);
  // The same of taps, as often as it is called; and of one tap, to /p, or a publisher's events, to
  // t, that are as they should be, but for some words of the header.
  void watch();
  void watch(detail::OutputCore& from, detail::TapCore& by);
  void introduce_tap(const std::vector<Patch>& patches);
  void introduce_events(const std::vector<Patch>& patches);

  // Publishes a sample that tells whether it is whole; says what became of it.
  Outcome publish(detail::OutputCore& from, bool loan, std::uint32_t words);
  // Requires that the sample is one that /p published, if it says that it comes from there, and
  // anyhow that it lies in memory; returns its number.
  std::uint64_t require_whole(const detail::HeldSample& sample) const;
  // The same of an event; 0: it has no sample of /p.
  std::uint64_t require_whole(const detail::TapEventData& event) const;
  // What /p has delivered to honest ports is taken, or counted where it went; and it has all its
  // slots.
  void require_accounts();

 private:
  std::uint64_t require_content(const detail::HeldSample& held) const;
  void show_growth(const detail::OutputCore& of) const;

  std::uint64_t published_ = 0;
  std::uint64_t last_link_ = 0;
  mutable std::size_t read_ = 0;  // of hostile samples: so that they are read
  std::uint64_t last_instance_ = 100;
};

}  // namespace arbiter::fuzz
