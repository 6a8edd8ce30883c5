#include "service/gate.hpp"

#include <pwd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "service/log.hpp"

namespace arbiter::service {
namespace {

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

// The name is that of /etc/passwd. A name service may ask a network that is not there, and take
// half a minute: all clients would wait because one was refused.
std::string describe_user(uid_t user) {
  const std::unique_ptr<FILE, int (*)(FILE*)> accounts(
      std::fopen("/etc/passwd", "re"), [](FILE* file) { return std::fclose(file); });
  passwd entry{};
  passwd* found = nullptr;
  std::array<char, 4096> buffer;
  while (accounts != nullptr &&
         fgetpwent_r(accounts.get(), &entry, buffer.data(), buffer.size(), &found) == 0) {
    if (entry.pw_uid == user) return entry.pw_name + (" (" + std::to_string(user) + ")");
  }
  return std::to_string(user);
}

Identity peer_identity(int socket) {
  ucred peer{};
  socklen_t size = sizeof peer;
  if (getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) {
    throw std::system_error(errno, std::generic_category(), "asking who connects");
  }
  Identity identity{peer.uid, std::vector<gid_t>(32)};
  for (;;) {
    size = static_cast<socklen_t>(identity.groups.size() * sizeof(gid_t));
    const int result = getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, identity.groups.data(), &size);
    if (result != 0 && errno != ERANGE) {
      throw std::system_error(errno, std::generic_category(), "asking for a client's groups");
    }
    identity.groups.resize(size / sizeof(gid_t));
    if (result == 0) break;
  }
  identity.groups.push_back(peer.gid);
  return identity;
}

Gate::Gate(std::optional<std::string> file) : file_(std::move(file)), policy_(geteuid()) {}

std::optional<Policy> Gate::read(Findings& findings) const {
  if (!file_) return {};
  try {
    require_protected(*file_);
    rules::Diagnostics diagnostics;
    const rules::TextFile text(
        *file_, rules::read_bytes(*file_, rules::kMaxFileBytes, rules::Accept::kRegularFile));
    Policy policy = Policy::parse(text, geteuid(), accounts_of_this_machine(), diagnostics);
    findings.add("the policy", std::move(diagnostics));
    return policy;
  } catch (const std::runtime_error& error) {
    findings.add_failure(error.what());
    return {};
  }
}

void Gate::put_in_force(const Policy& policy) {
  policy_ = policy;
  log::info("the policy of {} is in force, {} rules", *file_, policy_.size());
}

void Gate::require(const Client& client, Action action, std::string_view port) const {
  const Identity who = peer_identity(client.socket());
  const Policy::Verdict verdict = policy_.may(who, action, port);
  if (verdict.allowed) return;
  throw std::runtime_error("user " + describe_user(who.user) + " may not " +
                           describe(action, port) + ": " + verdict.reason);
}

}  // namespace arbiter::service
