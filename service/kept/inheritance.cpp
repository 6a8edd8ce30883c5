#include "service/kept/inheritance.hpp"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <system_error>

#include "shm/segment.hpp"

namespace arbiter::service {

FileIdentity FileIdentity::of(const shm::FileDescriptor& file) {
  struct stat status {};
  if (fstat(file.get(), &status) != 0) {
    throw std::system_error(errno, std::generic_category(), "looking at a segment");
  }
  return {status.st_dev, status.st_ino};
}

StateFile::StateFile(const std::string& directory, const std::string& instance)
    : path_(directory + "/" + instance + ".state") {}

// The 22nd field of /proc/PID/stat. The 2nd is a name in brackets, of any characters.
std::uint64_t start_of_process(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto name_end = text.rfind(')');
  if (name_end == std::string::npos) return 0;
  std::istringstream fields(text.substr(name_end + 1));
  std::string field;
  for (int i = 3; i <= 21; ++i) fields >> field;
  std::uint64_t started = 0;
  fields >> started;
  return started;
}

bool Process::lives() const { return pid > 0 && start_of_process(pid) == started; }

std::optional<Predecessor> StateFile::read() const {
  std::ifstream file(path_);
  std::string board;
  std::string registry;
  Realm realm;
  file >> board >> realm.board.device >> realm.board.inode;
  file >> registry >> realm.registry.device >> realm.registry.inode;
  if (!file || board != "board" || registry != "registry") return {};
  std::string word;
  Process component;
  bool is_survived = false;
  while (!is_survived && file >> word >> component.pid >> component.started) {
    is_survived = component.lives();
  }
  return Predecessor{realm, is_survived};
}

void StateFile::write(const Realm& realm, const std::vector<Process>& components) {
  const std::string draft = path_ + ".new";
  {
    std::ofstream file(draft);
    file << "board " << realm.board.device << ' ' << realm.board.inode << "\nregistry "
         << realm.registry.device << ' ' << realm.registry.inode << '\n';
    for (const Process& each : components) {
      file << "component " << each.pid << ' ' << each.started << '\n';
    }
    if (!file.flush()) {
      throw std::system_error(errno, std::generic_category(), "writing " + draft);
    }
  }
  if (std::rename(draft.c_str(), path_.c_str()) != 0) {
    throw std::system_error(errno, std::generic_category(), "writing " + path_);
  }
  size_ = components.size();
}

void StateFile::add(const Process& component) noexcept {
  std::ofstream(path_, std::ios::app)
      << "component " << component.pid << ' ' << component.started << std::endl;
  ++size_;
}

void StateFile::remove() const noexcept { unlink(path_.c_str()); }

shm::FileDescriptor reopen_inherited(const shm::FileDescriptor& handed_back, std::size_t size) {
  if (shm::checked_size(handed_back, shm::Seals::kFixedSize) != size) {
    throw std::runtime_error("it has another size, as of another version");
  }
  struct stat status {};
  if (fstat(handed_back.get(), &status) != 0 || status.st_uid != geteuid() ||
      (status.st_mode & (S_IWGRP | S_IWOTH)) != 0) {
    throw std::runtime_error("it was not made by a daemon of this user");
  }
  return shm::reopen(handed_back, O_RDWR);
}

void store(const std::string& name, const shm::FileDescriptor& descriptor) {
  const int fd = descriptor.get();
  const std::string state = "FDSTORE=1\nFDNAME=" + name;
  static_cast<void>(sd_pid_notify_with_fds(0, 0, state.c_str(), &fd, 1));
}

void discard_stored(const std::string& name) {
  sd_notify(0, ("FDSTOREREMOVE=1\nFDNAME=" + name).c_str());
}

std::vector<StoredDescriptor> take_stored() {
  char** names = nullptr;
  const int count = sd_listen_fds_with_names(1, &names);
  std::vector<StoredDescriptor> stored;
  for (int i = 0; i < count; ++i) {
    stored.push_back({names[i], shm::FileDescriptor(SD_LISTEN_FDS_START + i)});
    free(names[i]);  // NOLINT: that is how libsystemd hands them out
  }
  free(names);  // NOLINT
  return stored;
}

}  // namespace arbiter::service
