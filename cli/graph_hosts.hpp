// The boxes of hosts in a picture: by an application's modules, or by the links that run.
#pragma once

#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "drawing/places.hpp"
#include "rules/model/load.hpp"
#include "rules/text/diagnostic.hpp"
#include "wire/hosts.hpp"

namespace arbiter::cli {

// By the modules of the application in that file. What is wrong with it, or on no host, or on
// several, is reported. Throws rules::FileError.
[[nodiscard]] drawing::Places places_by(const std::string& file, const rules::RuleSet& rules,
                                        rules::Diagnostics& diagnostics);

// What the links have said of the hosts, and the daemons of other hosts of themselves.
struct SeenHosts {
  wire::HostsDocument hosts;
  shm::Nanoseconds time = 0;                            // of that; CLOCK_MONOTONIC
  std::map<std::string, drawing::Situation> elsewhere;  // by host, of those that have answered
  std::map<std::string, std::string> why_not;           // of the others
};
// Boxes of what was seen; nothing where there is no other host. Keeps references to both.
[[nodiscard]] std::optional<drawing::Places> places_by(const SeenHosts& seen,
                                                       const drawing::Situation& here);

// Asks the link of this host, which asks others and waits for them for a second, on a thread of its
// own.
class HostsInquirer {
 public:
  explicit HostsInquirer(std::string instance) : instance_(std::move(instance)) {}

  // Waits for the answer. Null: no link runs here.
  [[nodiscard]] std::shared_ptr<const SeenHosts> ask();
  // Does so once a second from now on. Call after catch_interrupts().
  void begin();
  // The last answer.
  [[nodiscard]] std::shared_ptr<const SeenHosts> last() const;

 private:
  void run(const std::stop_token& stop);

  const std::string instance_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::shared_ptr<const SeenHosts> last_;
  std::string said_;     // of the one who asks
  std::jthread thread_;  // ends before the rest
};

}  // namespace arbiter::cli
