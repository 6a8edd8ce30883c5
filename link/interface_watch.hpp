// Whether the network interfaces that a link uses are still as they were when it joined its
// network.
//
// DDS takes an interface's address and its groups when it joins, and never again. So an interface
// that has another address, or that went away and came back, leads nowhere until the link joins
// anew. Both are seen: what it is like now, and, by netlink, that it was gone in between.
//
// Thread safety: one thread.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "shm/file_descriptor.hpp"

namespace arbiter::link {

class InterfaceWatch {
 public:
  // By name or by IPv4 address. Throws std::system_error.
  explicit InterfaceWatch(std::vector<std::string> interfaces);

  // They are what they are now. Call it before joining: nothing that happens from then on is
  // missed.
  void begin();
  // Those of them that were there then, were up and had an address.
  [[nodiscard]] std::vector<std::string> there() const;
  // Which of them was not there then, and which there are instead, as a sentence; empty: all were.
  [[nodiscard]] std::string missing() const;
  // What has changed since, as a sentence for people; empty: nothing that matters. Does not wait.
  [[nodiscard]] std::string change();

 private:
  // An interface by its number, which a new one of the same name does not have, and the address
  // that DDS uses: the first. 0: there is none.
  struct Place {
    unsigned index = 0;
    std::uint32_t address = 0;
    bool is_up = false;
    // For DDS to join by.
    [[nodiscard]] bool is_usable() const noexcept { return is_up && address != 0; }
    // To DDS, for which one without an address is none.
    friend bool operator==(const Place& one, const Place& other) noexcept {
      return one.address == other.address && (one.index == other.index || one.address == 0);
    }
  };
  using Places = std::map<std::string, Place>;

  // Nothing: memory is short, or no descriptor is left.
  [[nodiscard]] std::optional<Places> look() const;
  // What netlink has said. True: something may have changed; `was_gone`: one of ours was.
  [[nodiscard]] bool hear(bool& was_gone);
  [[nodiscard]] bool is_loss_of_ours(const void* message) const;

  const std::vector<std::string> interfaces_;
  shm::FileDescriptor netlink_;
  Places places_;
  bool has_news_ = false;  // that nobody could look into
  bool was_gone_ = false;  // one of ours, by that news
};

}  // namespace arbiter::link
