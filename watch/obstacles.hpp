// What besides the rules keeps samples from getting through: what the daemon's status knows.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "watch/sources.hpp"
#include "wire/status.hpp"

namespace arbiter::watch {

struct Obstacle {
  const char* code;      // docs/explaining.md has them
  std::string text;      // for people
  bool is_wrong = true;  // else it is worth knowing, and may be as it should be
};

// By source: what has become of it on the host that it came from.
using Fates = std::map<std::string, std::string>;

class Obstacles {
 public:
  // Keeps references, and looks into /proc. `known_sources` and `known_ports`: those that the model
  // mentions; empty where that is not known.
  Obstacles(const wire::Status& status, const std::string& port, const Sources& sources,
            std::vector<std::string> known_sources, std::vector<std::string> known_ports,
            Fates fates = {});

  [[nodiscard]] std::vector<Obstacle> of_port() const;
  [[nodiscard]] std::vector<Obstacle> of_connection(const std::string& source) const;
  // Of one that need not have a connection.
  [[nodiscard]] std::vector<Obstacle> of_source(const std::string& source) const;

  // Why the port is idle though that source is selected; empty where it is not, or can deliver.
  [[nodiscard]] std::string why_it_cannot_deliver(const std::string& source) const;
  // Why nothing of a winner reaches the port; empty where something does, as far as is known.
  [[nodiscard]] std::string why_nothing_comes_of(const std::string& source) const;
  // A predecessor's model is in force, because the daemon's own was refused: of_port() says it.
  [[nodiscard]] bool is_model_refused() const { return status_.model.refused.has_value(); }
  // Nobody has it open, nothing has ever arrived, and nothing else could be meant by the name.
  [[nodiscard]] bool is_out_of_use(const std::string& source) const;
  // "nav (pid 12)", empty where nobody has it open.
  [[nodiscard]] std::string component_of(const std::string& source) const;

 private:
  using Ports = std::vector<std::string> wire::StrangerStatus::*;

  [[nodiscard]] const wire::ConnectionStatus* connection_of(const std::string& source) const;
  [[nodiscard]] bool is_away() const { return input_ != nullptr && input_->away_pid; }
  [[nodiscard]] bool is_open() const { return input_ != nullptr && input_->open; }
  // A component that this daemon does not know, and that has the port open.
  [[nodiscard]] const wire::StrangerStatus* stranger_with(Ports ports,
                                                          const std::string& name) const;
  void add_other_strangers(std::vector<Obstacle>& result) const;
  void add_port_name(std::vector<Obstacle>& result) const;
  void add_publisher(const std::string& source, std::vector<Obstacle>& result) const;
  [[nodiscard]] std::optional<Obstacle> other_source(const std::string& name) const;

  const wire::Status& status_;
  const std::string port_;
  const Sources& sources_;
  const std::vector<std::string> known_sources_, known_ports_;
  const Fates fates_;
  const wire::InputStatus* input_;  // null: the status does not have it
};

}  // namespace arbiter::watch
