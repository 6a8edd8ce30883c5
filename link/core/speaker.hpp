// Which host a source is taken from, of those that have it open.
//
// One at a time: the one that is obeyed stays so until it is gone, or does not hear this link any
// more (pulse.hpp), whoever comes meanwhile. Only
// a link that has been started again takes the place of its earlier life, which may be believed to
// live for a while yet (a lease): they are one host.
//
// Thread safety: none of its own.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "link/core/held_tokens.hpp"

namespace arbiter::link {

// A host that offers the source.
struct Offerer {
  std::uint64_t key = 0;  // by which the transport knows it
  std::string host;
  Incarnation incarnation = 0;
};

class Speaker {
 public:
  // A key that was added already changes nothing.
  void add(Offerer offerer);
  void remove(std::uint64_t key);

  // Null: nobody offers the source.
  [[nodiscard]] const Offerer* current() const noexcept;
  // In byte order, each once: more than one is worth a warning.
  [[nodiscard]] std::vector<std::string> hosts() const;

 private:
  void choose();

  std::vector<Offerer> offerers_;  // in the order in which they came
  std::uint64_t current_ = 0;      // its key, if there are any
};

}  // namespace arbiter::link
