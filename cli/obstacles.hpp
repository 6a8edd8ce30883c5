// What besides the rules keeps samples from getting through: what the daemon's status knows.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace arbiter::cli {

class Obstacles {
 public:
  // Keeps a reference to the document.
  Obstacles(const nlohmann::json& status, const std::string& port);

  // Each in words, for people.
  [[nodiscard]] std::vector<std::string> of_port() const;
  [[nodiscard]] std::vector<std::string> of_connection(const std::string& source) const;

 private:
  void add_publisher(const std::string& source, std::vector<std::string>& result) const;

  const nlohmann::json& status_;
  const nlohmann::json* input_;  // null: the status does not have it
};

}  // namespace arbiter::cli
