#include "service/policy/users.hpp"

#include <pwd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "wire/local_user.hpp"

namespace arbiter::service {

// The name is that of /etc/passwd. A name service may ask a network that is not there, and take
// half a minute: all clients would wait because one was refused.
std::string name_of_user(uid_t user) {
  const std::unique_ptr<FILE, int (*)(FILE*)> accounts(
      std::fopen("/etc/passwd", "re"), [](FILE* file) { return std::fclose(file); });
  passwd entry{};
  passwd* found = nullptr;
  std::array<char, 4096> buffer;
  while (accounts != nullptr &&
         fgetpwent_r(accounts.get(), &entry, buffer.data(), buffer.size(), &found) == 0) {
    if (entry.pw_uid == user) return entry.pw_name;
  }
  return std::to_string(user);
}

std::string describe_user(uid_t user) {
  const std::string number = std::to_string(user);
  const std::string name = name_of_user(user);
  return name == number ? number : name + " (" + number + ")";
}

Identity peer_identity(int socket) {
  wire::LocalUser who = wire::user_at(socket);
  return {who.user, std::move(who.groups)};
}

Identity identity_of(uid_t user, std::string_view groups) {
  Identity identity{user, {}};
  while (!groups.empty()) {
    gid_t group = 0;
    const auto [end, error] = std::from_chars(groups.data(), groups.data() + groups.size(), group);
    const auto read = static_cast<std::size_t>(end - groups.data());
    if (error != std::errc{} || (read != groups.size() && groups[read] != ' ')) {
      throw std::runtime_error("the groups of a user are numbers between blanks");
    }
    identity.groups.push_back(group);
    groups.remove_prefix(std::min(read + 1, groups.size()));
  }
  return identity;
}

}  // namespace arbiter::service
