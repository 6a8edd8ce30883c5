// Who wins at each input port of a running instance, and each change of it.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "shm/activity.hpp"
#include "shm/ids.hpp"
#include "watch/instance.hpp"
#include "watch/picture.hpp"

namespace arbiter::watch {

struct WinnerAt {
  std::string port;
  std::optional<std::string> before;  // nothing: nobody won
  std::optional<std::string> winner;
  bool is_first = false;  // it was not looked at before: `before` is not known
  bool is_arbitrated = false;
  std::uint64_t generation = 0;
  shm::Nanoseconds time = 0;  // when the change happened, as far as activities tell
  shm::Nanoseconds seen = 0;  // when it was noticed
};

// Looks as often as its owner asks: what begins and ends between two looks is missed. Reads memory,
// and never asks the daemon. One thread.
class Winners {
 public:
  using Wanted = std::function<bool(std::string_view port)>;

  // Keeps the instance, of which the owner calls update().
  Winners(std::shared_ptr<Instance> instance, Wanted wanted);

  // The ports that are new, and those whose winner is another than at the last look. Without those
  // of which not all sources can be seen yet; empty where no picture of one moment could be taken.
  std::vector<WinnerAt> look();
  // Of each port, as it was at the last look.
  [[nodiscard]] const std::map<std::string, WinnerAt>& now() const { return now_; }
  // When the last look was, and when an activity ends that it saw.
  [[nodiscard]] shm::Nanoseconds looked_at() const { return picture_.now; }
  [[nodiscard]] shm::Nanoseconds next_end() const { return picture_.next_end(); }

 private:
  [[nodiscard]] std::map<std::string, shm::PortId> ports(const shm::TableView& table) const;
  [[nodiscard]] Picture take(const shm::DecisionMemory& memory) const;
  [[nodiscard]] shm::Nanoseconds time_of(const WinnerAt& change, shm::PortId port,
                                         const Picture& picture) const;

  const std::shared_ptr<Instance> instance_;
  const Wanted wanted_;
  std::shared_ptr<const shm::DecisionMemory> memory_;  // of the last look
  Picture picture_;                                    // of the last look
  std::map<std::string, WinnerAt> now_;
};

}  // namespace arbiter::watch
