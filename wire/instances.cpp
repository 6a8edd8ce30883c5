#include "wire/instances.hpp"

#include <dirent.h>
#include <sys/socket.h>

#include <algorithm>
#include <fstream>
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

// 0: not known, or not to be seen from here.
pid_t pid_at_other_end(int socket) {
  ucred peer{};
  socklen_t size = sizeof peer;
  return getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 ? peer.pid : 0;
}

// By a signal. A debugger that holds it ("t") does not let go of it for another.
bool is_stopped(pid_t pid) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("State:")) return line.find('T') != std::string::npos;
  }
  return false;
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
  const pid_t pid = pid_at_other_end(socket);
  return "arbiterd" + (pid > 0 ? " (pid " + std::to_string(pid) + ")" : std::string()) +
         " of instance \"" + instance + "\"";
}

std::string describe_silence(int socket) {
  const pid_t pid = pid_at_other_end(socket);
  if (pid > 0 && is_stopped(pid)) return "it is stopped; run: kill -CONT " + std::to_string(pid);
  return "it is stopped, or busy";
}

}  // namespace arbiter::wire
