// From which hosts the arrivals come that arbiter echo prints.
#pragma once

#include <map>
#include <string>

#include <arbiter/arbiter.hpp>
#include <nlohmann/json.hpp>

#include "shm/activity.hpp"

namespace arbiter::cli {

// Asks the daemon where another publisher begins to send, and not for each arrival.
class EchoHosts {
 public:
  explicit EchoHosts(std::string instance) : instance_(std::move(instance)) {}

  // " (host head #8841)"; " (there #8841)": the host is not known; empty: it began here.
  [[nodiscard]] std::string text(const std::string& source, const Origin& origin);
  // {publisher, sequence, host} of an arrival that was passed on; without `host` where that is not
  // known. The publisher as text: in a number of JSON not all readers keep 64 bits.
  [[nodiscard]] nlohmann::json json_of(const std::string& source, const Origin& origin);

 private:
  struct Known {
    std::uint64_t publisher = 0;
    bool is_said = false;  // else it is asked for again
    std::string host;      // empty: it is not known
  };
  [[nodiscard]] const std::string& host_of(const std::string& source, const Origin& origin);
  void ask();

  const std::string instance_;
  std::map<std::string, Known> known_;  // by source, of the last publisher
  shm::Nanoseconds ask_again_ = 0;
};

}  // namespace arbiter::cli
