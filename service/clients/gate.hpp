// The policy in force, and the clients that it is asked about.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "service/clients/client.hpp"
#include "service/log/findings.hpp"
#include "service/policy/policy.hpp"

namespace arbiter::service {

class Gate {
 public:
  // Without a file the default policy holds.
  explicit Gate(std::optional<std::string> file);

  // What the file says now, if there is one; to be used only if nothing is found to be wrong.
  [[nodiscard]] std::optional<Policy> read(Findings& findings) const;
  void put_in_force(const Policy& policy);
  [[nodiscard]] bool has_file() const { return file_.has_value(); }
  [[nodiscard]] const Policy& policy() const { return policy_; }

  // Empty if the client may do it; else who may not do what, and which line of the policy says so.
  [[nodiscard]] std::optional<std::string> why_not(const Client& client, Action action,
                                                   std::string_view port = {}) const;
  // The same, thrown as std::runtime_error.
  void require(const Client& client, Action action, std::string_view port = {}) const;
  // To go back to an earlier model, for which there is no action of its own.
  void require_rollback(const Client& client) const;
  // Of somebody for whom a client asks.
  void require(const Identity& who, Action action) const;

 private:
  // `deed`: in the words of a message.
  [[nodiscard]] std::optional<std::string> why_not(const Identity& who, Action action,
                                                   std::string_view port,
                                                   const std::string& deed) const;

  std::optional<std::string> file_;
  Policy policy_;
};

}  // namespace arbiter::service
