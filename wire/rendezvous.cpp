#include "wire/rendezvous.hpp"

#include <fcntl.h>
#include <pwd.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <system_error>

#include "wire/messages.hpp"

namespace arbiter::wire {
namespace {

constexpr const char* kSystemDirectory = "/run/arbiter";
// Of the link's service, which has a user of its own.
constexpr const char* kLinkDirectory = "/run/arbiter-link";
constexpr const char* kSocketEnding = ".sock";
constexpr const char* kLinkEnding = ".link";

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::string() : std::string(value);
}

std::string temporary_directory(uid_t user) {
  const std::string base = environment("TMPDIR");
  return (base.empty() ? "/tmp" : base) + "/arbiter-" + std::to_string(user);
}

[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error(what + ": " + std::generic_category().message(errno));
}

// Whoever may write in the directory could put a socket of his own there.
void require_safe(const std::string& directory) {
  struct stat status {};
  if (lstat(directory.c_str(), &status) != 0) fail("cannot look at " + directory);
  if (!S_ISDIR(status.st_mode)) throw std::runtime_error(directory + " is not a directory");
  if (status.st_uid != geteuid()) {
    throw std::runtime_error(directory + " belongs to user " + std::to_string(status.st_uid) +
                             "; set RUNTIME_DIRECTORY to a directory of your own");
  }
  if ((status.st_mode & (S_IWGRP | S_IWOTH)) != 0) {
    throw std::runtime_error("others may write in " + directory + "; run: chmod go-w " + directory);
  }
}

std::string make_safe(const std::string& directory) {
  if (mkdir(directory.c_str(), 0755) != 0 && errno != EEXIST) fail("cannot make " + directory);
  require_safe(directory);
  return directory;
}

bool may_use_system_directory() {
  if (mkdir(kSystemDirectory, 0755) == 0) return true;
  struct stat status {};
  return errno == EEXIST && lstat(kSystemDirectory, &status) == 0 && S_ISDIR(status.st_mode) &&
         status.st_uid == geteuid();
}

// Asks the name services, one of which may wait for a network that is not there: so only where
// nothing else tells, and once.
std::optional<uid_t> look_up_arbiter_user() {
  passwd entry{};
  passwd* found = nullptr;
  std::vector<char> buffer(4096);
  if (getpwnam_r("arbiter", &entry, buffer.data(), buffer.size(), &found) != 0) return {};
  if (found == nullptr) return {};
  return entry.pw_uid;
}
std::optional<uid_t> arbiter_user() {
  static const std::optional<uid_t> user = look_up_arbiter_user();
  return user;
}

// An address for a path of any length: a long one goes by way of its directory's descriptor.
struct Address {
  sockaddr_un address{};
  shm::FileDescriptor directory;
};

Address address_of(const std::string& directory, const std::string& file) {
  Address result;
  result.address.sun_family = AF_UNIX;
  std::string path = directory + "/" + file;
  if (path.size() >= sizeof result.address.sun_path) {
    result.directory.reset(open(directory.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
    path = "/proc/self/fd/" + std::to_string(result.directory.get()) + "/" + file;
  }
  std::memcpy(result.address.sun_path, path.c_str(), path.size() + 1);
  return result;
}

shm::FileDescriptor make_socket(int mode = 0) {
  shm::FileDescriptor made(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | mode, 0));
  if (!made) fail("cannot make a socket");
  // A daemon that is stopped holds nobody up for longer than this, be it in connect() or sendmsg().
  const timeval limit{kMaxWaitToSend, 0};
  setsockopt(made.get(), SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
  return made;
}

// Whether root has given that directory of the system to `user`: nobody else can make it in /run.
// So a daemon of a dynamic user is known as the system's where no name service knows that user.
bool has_system_directory(uid_t user, const std::string& directory) {
  struct stat parent {};
  struct stat status {};
  return lstat("/run", &parent) == 0 && parent.st_uid == 0 &&
         (parent.st_mode & (S_IWGRP | S_IWOTH)) == 0 && lstat(directory.c_str(), &status) == 0 &&
         S_ISDIR(status.st_mode) && status.st_uid == user &&
         (status.st_mode & (S_IWGRP | S_IWOTH)) == 0;
}

// As far as no name service needs to be asked.
bool is_surely_trusted(uid_t user, const std::string& directory) {
  return user == 0 || user == geteuid() ||
         ((directory == kSystemDirectory || directory == kLinkDirectory) &&
          has_system_directory(user, directory));
}

bool is_trusted(uid_t user, const std::string& directory) {
  return is_surely_trusted(user, directory) || user == arbiter_user();
}

bool is_surely_trusted_ones(const std::string& directory) {
  struct stat status {};
  return lstat(directory.c_str(), &status) == 0 && is_surely_trusted(status.st_uid, directory);
}

// Whose it is, if it is a stranger's: a daemon listens in a directory of its own, so that nobody
// else can put a socket there, and in that of a stranger there is none of ours.
std::optional<uid_t> stranger_who_owns(const std::string& directory) {
  struct stat status {};
  if (lstat(directory.c_str(), &status) != 0 || is_trusted(status.st_uid, directory)) return {};
  return status.st_uid;
}

const char* why_not_connected(int error) {
  switch (error) {
    case ENOENT:
      return "there is none";
    case ECONNREFUSED:
      return "nobody listens there";
    case EAGAIN:
      return "somebody listens there, but lets nobody in: is it stopped?";
    default:
      break;
  }
  const char* const described = strerrordesc_np(error);
  return described == nullptr ? "it cannot be connected to" : described;
}

void pass_over(const std::string& directory, const std::string& file, const char* why,
               std::string& why_not) {
  why_not.append(why_not.empty() ? "tried " : ", ");
  why_not.append(directory).append("/").append(file).append(": ").append(why);
}

// Who listens at that file of the directory, if it is trusted. `who`: "daemon", "link".
std::optional<shm::FileDescriptor> connect_in(const std::string& directory, const std::string& file,
                                              const char* who, std::string& why_not, int mode = 0,
                                              bool* is_full = nullptr) {
  // Not even connected to: who listens there could let nobody in, for a second each time.
  if (const auto stranger = stranger_who_owns(directory)) {
    char why[112];
    std::snprintf(
        why, sizeof why,
        "that directory belongs to user %u, who is neither root, nor \"arbiter\", nor you",
        *stranger);
    pass_over(directory, file, why, why_not);
    return {};
  }
  shm::FileDescriptor socket = make_socket(mode);
  const Address at = address_of(directory, file);
  const auto* address = reinterpret_cast<const sockaddr*>(&at.address);
  if (connect(socket.get(), address, sizeof at.address) != 0) {
    if (is_full != nullptr) *is_full = errno == EAGAIN;
    pass_over(directory, file, why_not_connected(errno), why_not);
    return {};
  }
  ucred peer{};
  socklen_t size = sizeof peer;
  if (getsockopt(socket.get(), SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) {
    pass_over(directory, file, "it is not known whose that is", why_not);
    return {};
  }
  if (is_trusted(peer.uid, directory)) return socket;
  char why[96];
  std::snprintf(why, sizeof why,
                "that %s runs as user %u, who is neither root, nor \"arbiter\", nor you", who,
                peer.uid);
  pass_over(directory, file, why, why_not);
  return {};
}

bool are_same_file(const std::string& one, const std::string& other) {
  struct stat a {};
  struct stat b {};
  return stat(one.c_str(), &a) == 0 && stat(other.c_str(), &b) == 0 && a.st_dev == b.st_dev &&
         a.st_ino == b.st_ino;
}

}  // namespace

std::string instance_name(const std::string& given) {
  std::string name = given.empty() ? environment("ARBITER_INSTANCE") : given;
  if (name.empty()) name = kDefaultInstance;
  const bool fine = name.size() <= 64 && name[0] != '.' &&
                    std::all_of(name.begin(), name.end(), [](unsigned char c) {
                      return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.';
                    });
  if (!fine) {
    throw std::invalid_argument(std::string(given.empty() ? "$ARBITER_INSTANCE: " : "") + '"' +
                                name +
                                "\" is not a name for an instance: use 1 to 64 letters, digits, "
                                "'_', '-' or '.', not beginning with '.'");
  }
  return name;
}

std::string daemon_directory() {
  const std::string given = environment("RUNTIME_DIRECTORY");
  if (!given.empty()) return make_safe(given.substr(0, given.find(':')));
  const std::string session = environment("XDG_RUNTIME_DIR");
  // It may be left over from another session, or another user's: su keeps the variable.
  const bool is_ours =
      !session.empty() && faccessat(AT_FDCWD, session.c_str(), W_OK | X_OK, AT_EACCESS) == 0;
  if (is_ours) return make_safe(session + "/arbiter");
  if (may_use_system_directory()) return make_safe(kSystemDirectory);
  return make_safe(temporary_directory(geteuid()));
}

bool is_a_strangers(const std::string& directory) {
  return stranger_who_owns(directory).has_value();
}

namespace {

// Those that are known without asking who the user `arbiter` is, and last his.
std::vector<std::string> usual_directories() {
  std::vector<std::string> directories;
  const auto add = [&](std::string directory) {
    if (std::find(directories.begin(), directories.end(), directory) == directories.end()) {
      directories.push_back(std::move(directory));
    }
  };
  const std::string given = environment("RUNTIME_DIRECTORY");
  if (!given.empty()) add(given.substr(0, given.find(':')));
  const std::string session = environment("XDG_RUNTIME_DIR");
  if (!session.empty()) add(session + "/arbiter");
  add(kSystemDirectory);
  add(temporary_directory(geteuid()));
  add(temporary_directory(0));
  return directories;
}
std::optional<std::string> last_directory() {
  const auto user = arbiter_user();
  return user ? std::optional(temporary_directory(*user)) : std::nullopt;
}

}  // namespace

std::vector<std::string> client_directories() {
  std::vector<std::string> directories = usual_directories();
  const auto last = last_directory();
  const bool is_new =
      last && std::find(directories.begin(), directories.end(), *last) == directories.end();
  if (is_new) directories.push_back(*last);
  return directories;
}

namespace {

// `who`: "a daemon", "a link".
Listener listen_as(const std::string& directory, const std::string& instance,
                   const std::string& ending, const std::string& lock_ending, const char* who) {
  Listener listener;
  listener.path = directory + "/" + instance + ending;
  const std::string lock_path = directory + "/" + instance + lock_ending;
  listener.lock.reset(open(lock_path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600));
  if (!listener.lock) fail("cannot open " + lock_path);
  int locked = 0;
  do {
    locked = flock(listener.lock.get(), LOCK_EX | LOCK_NB);
  } while (locked != 0 && errno == EINTR);
  if (locked != 0) {
    if (errno != EWOULDBLOCK) fail("cannot lock " + lock_path);
    throw std::runtime_error(std::string(who) + " of instance \"" + instance +
                             "\" is running already (" + listener.path +
                             "); choose another name with --instance");
  }
  unlink(listener.path.c_str());  // left by one that was killed: the lock says nobody has it
  listener.socket = make_socket();
  const Address at = address_of(directory, instance + ending);
  const auto* address = reinterpret_cast<const sockaddr*>(&at.address);
  if (bind(listener.socket.get(), address, sizeof at.address) != 0) {
    fail("cannot listen at " + listener.path);
  }
  if (chmod(listener.path.c_str(), 0666) != 0) fail("cannot open up " + listener.path);
  if (listen(listener.socket.get(), SOMAXCONN) != 0) fail("cannot listen at " + listener.path);
  return listener;
}

}  // namespace

Listener listen_at(const std::string& directory, const std::string& instance) {
  return listen_as(directory, instance, kSocketEnding, ".lock", "a daemon");
}

Listener listen_as_link(const std::string& directory, const std::string& instance) {
  return listen_as(directory, instance, kLinkEnding, ".link-lock", "a link");
}

std::optional<shm::FileDescriptor> connect_to_daemon(const std::string& instance,
                                                     std::string& why_not, std::string* found_in,
                                                     int mode) {
  why_not.clear();
  bool is_full = false;  // it is there, and lets others in first
  const auto try_in = [&](const std::string& directory) {
    auto socket =
        connect_in(directory, instance + kSocketEnding, "daemon", why_not, mode, &is_full);
    if (socket && found_in != nullptr) *found_in = directory;
    return socket;
  };
  const std::vector<std::string> usual = usual_directories();
  for (const std::string& directory : usual) {
    if (auto socket = try_in(directory)) return socket;
    if (is_full) return {};
  }
  const auto last = last_directory();
  const bool is_new = last && std::find(usual.begin(), usual.end(), *last) == usual.end();
  return is_new ? try_in(*last) : std::nullopt;
}

std::optional<shm::FileDescriptor> connect_to_link(const std::string& instance,
                                                   std::string& why_not) {
  why_not.clear();
  std::vector<std::string> directories = usual_directories();
  directories.emplace_back(kLinkDirectory);
  for (const std::string& directory : directories) {
    if (auto socket = connect_in(directory, instance + kLinkEnding, "link", why_not)) return socket;
  }
  return std::nullopt;
}

std::vector<std::string> other_daemons(const std::string& instance, const std::string& directory) {
  std::vector<std::string> directories = usual_directories();
  // Where this user's session meets, though this process is not of it.
  directories.push_back("/run/user/" + std::to_string(geteuid()) + "/arbiter");
  std::vector<std::string> known{directory + "/" + instance + ".sock"};
  for (const std::string& other : directories) {
    // What lies in a stranger's is not looked at; and he makes nobody wait for a name service by
    // making a directory: here a daemon has been found.
    if (!is_surely_trusted_ones(other)) continue;
    std::string path = other;
    path.append("/").append(instance).append(".sock");
    const bool is_known = std::any_of(known.begin(), known.end(), [&](const std::string& each) {
      return are_same_file(each, path);
    });
    if (is_known) continue;
    try {
      std::string why_not;
      if (connect_in(other, instance + kSocketEnding, "daemon", why_not)) known.push_back(path);
    } catch (const std::exception&) {  // no descriptor is left: that is told where one is needed
    }
  }
  known.erase(known.begin());
  return known;
}

}  // namespace arbiter::wire
