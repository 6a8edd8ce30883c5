#include "wire/instances.hpp"

#include <dirent.h>
#include <sys/socket.h>

#include <algorithm>
#include <memory>
#include <set>
#include <string_view>

#include "wire/rendezvous.hpp"

namespace arbiter::wire {
namespace {

constexpr std::string_view kEnding = ".sock";
// Enough to find the right one; whoever has more knows their names.
constexpr std::size_t kMaxNamed = 8;

bool listens(const std::string& instance) {
  try {
    std::string why_not;
    return instance_name(instance) == instance && connect_to_daemon(instance, why_not).has_value();
  } catch (const std::exception&) {  // what is no name of ours is no daemon of ours
    return false;
  }
}

}  // namespace

std::vector<std::string> listening_instances() {
  std::vector<std::string> result;
  for (const std::string& directory : client_directories()) {
    if (is_a_strangers(directory)) continue;  // there may be any number of names
    std::set<std::string> names;
    const std::unique_ptr<DIR, int (*)(DIR*)> listing(opendir(directory.c_str()), closedir);
    while (listing != nullptr) {
      const dirent* const entry = readdir(listing.get());
      if (entry == nullptr) break;
      const std::string_view file(entry->d_name);
      if (!file.ends_with(kEnding)) continue;
      names.emplace(file.substr(0, file.size() - kEnding.size()));
    }
    for (const std::string& name : names) {
      if (result.size() == kMaxNamed) return result;
      const bool is_known = std::find(result.begin(), result.end(), name) != result.end();
      if (!is_known && !name.empty() && listens(name)) result.push_back(name);
    }
  }
  return result;
}

std::string describe_listening_instances() {
  std::string text;
  for (const std::string& name : listening_instances()) {
    text += (text.empty() ? "; these instances run: " : ", ") + name;
  }
  return text;
}

std::string describe_daemon(int socket, const std::string& instance) {
  ucred peer{};
  socklen_t size = sizeof peer;
  const bool is_known =
      getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 && peer.pid > 0;
  return "arbiterd" + (is_known ? " (pid " + std::to_string(peer.pid) + ")" : std::string()) +
         " of instance \"" + instance + "\"";
}

}  // namespace arbiter::wire
