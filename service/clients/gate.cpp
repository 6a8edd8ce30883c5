#include "service/clients/gate.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <stdexcept>
#include <utility>

#include "service/log/log.hpp"
#include "service/policy/users.hpp"

namespace arbiter::service {
namespace {

// As long as a refusal is that goes into a message as a whole.
constexpr std::size_t kMaxAdvised = sizeof(wire::Message::text) - 1;

std::string describe(Action action, std::string_view port) {
  const std::string name(port);
  switch (action) {
    case Action::kOutput:
      return "open the output port " + name;
    case Action::kInput:
      return "open the input port " + name;
    case Action::kDeactivate:
      return "deactivate the source " + name;
    case Action::kObserve:
      return "observe";
    case Action::kReload:
      return "reload the files";
    case Action::kSwitch:
      return "switch to another model";
    case Action::kStop:
      return "stop the daemon";
    case Action::kReplay:
      return "replay the source " + name + " (give its arrivals their times)";
    case Action::kTap:
      return "tap the port " + name;
  }
  return "do that";
}

// A policy that anybody may rewrite protects nothing.
void require_protected(const std::string& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) return;  // reading it will say why
  if (S_ISREG(status.st_mode) && (status.st_mode & S_IWOTH) != 0) {
    throw std::runtime_error("every user may write the policy " + path + "; run: chmod o-w " +
                             path);
  }
}

}  // namespace

Gate::Gate(std::optional<std::string> file) : file_(std::move(file)), policy_(geteuid()) {}

std::optional<Policy> Gate::read(Findings& findings) const {
  if (!file_) return {};
  try {
    require_protected(*file_);
    rules::Diagnostics diagnostics;
    const rules::TextFile text(
        *file_, rules::read_bytes(*file_, rules::kMaxFileBytes, rules::Accept::kRegularFile));
    Policy policy = Policy::parse(text, geteuid(), accounts_of_this_machine(), diagnostics);
    findings.add(kOfPolicy, std::move(diagnostics));
    return policy;
  } catch (const std::runtime_error& error) {
    findings.add_failure(error.what());
    return {};
  }
}

void Gate::put_in_force(const Policy& policy) {
  policy_ = policy;
  log::info("the policy of {} is in force, {} {}", *file_, policy_.size(),
            policy_.size() == 1 ? "rule" : "rules");
}

std::optional<std::string> Gate::why_not(const Client& client, Action action,
                                         std::string_view port) const {
  return why_not(peer_identity(client.socket()), action, port, describe(action, port));
}

std::optional<std::string> Gate::why_not(const Identity& who, Action action, std::string_view port,
                                         const std::string& deed) const {
  const Policy::Verdict verdict = policy_.may(who, action, port);
  if (verdict.allowed) return {};
  std::string why = "user " + describe_user(who.user) + " may not " + deed + ": " + verdict.reason;
  if (!verdict.lacks_line) return why;
  const std::string line = line_that_allows(name_of_user(who.user), action, port);
  const std::string advice = "; one that would: " + line;
  // Half a line could allow something else.
  if (line.empty() || why.size() + advice.size() > kMaxAdvised) return why;
  return why + advice;
}

void Gate::require(const Client& client, Action action, std::string_view port) const {
  if (const auto why = why_not(client, action, port)) throw std::runtime_error(*why);
}

void Gate::require_rollback(const Client& client) const {
  const auto why = why_not(peer_identity(client.socket()), Action::kReload, {},
                           "go back to an earlier model (the policy's action reload)");
  if (why) throw std::runtime_error(*why);
}

void Gate::require(const Identity& who, Action action) const {
  const auto why = why_not(who, action, {}, describe(action, {}));
  if (why) throw std::runtime_error(*why);
}

}  // namespace arbiter::service
