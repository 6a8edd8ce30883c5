#include "service/kept/state_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <system_error>

#include "service/kept/step.hpp"
#include "shm/file_descriptor.hpp"
#include "shm/memory_file.hpp"

namespace arbiter::service {
namespace {

constexpr mode_t kMode = 0644;

std::string line_of(const Process& component) {
  return "component " + std::to_string(component.pid) + ' ' + std::to_string(component.started) +
         '\n';
}

[[noreturn]] void fail(int error, const std::string& path) {
  throw std::system_error(error, std::generic_category(), "writing " + path);
}

}  // namespace

StateFile::StateFile(const std::string& directory, const std::string& instance)
    : path_(directory + "/" + instance + ".state") {}

std::optional<Predecessor> StateFile::read() {
  named_.reset();
  std::ifstream file(path_);
  std::string board;
  std::string registry;
  Realm realm;
  file >> board >> realm.board.device >> realm.board.inode;
  file >> registry >> realm.registry.device >> realm.registry.inode;
  if (!file || board != "board" || registry != "registry") return {};
  named_ = realm;
  std::string word;
  Process component;
  bool is_survived = false;
  while (!is_survived && file >> word >> component.pid >> component.started) {
    is_survived = component.lives();
  }
  return Predecessor{realm, is_survived};
}

void StateFile::write(const Realm& realm, const std::vector<Process>& components) {
  try {
    replace(realm, components);
  } catch (const std::system_error&) {
    if (named_ == realm) throw;
    remove();  // which may be the room that was missing
    replace(realm, components);
  }
}

void StateFile::replace(const Realm& realm, const std::vector<Process>& components) {
  std::ostringstream text;
  text << "board " << realm.board.device << ' ' << realm.board.inode << "\nregistry "
       << realm.registry.device << ' ' << realm.registry.inode << '\n';
  for (const Process& each : components) text << line_of(each);
  const std::string draft = path_ + ".new";
  const auto give_up = [&](const std::string& what) {
    const int error = errno;
    unlink(draft.c_str());
    fail(error, what);
  };
  const shm::FileDescriptor file(
      open(draft.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kMode));
  if (!file || !shm::write_whole(file.get(), text.str())) give_up(draft);
  at_step("state-drafted");
  if (std::rename(draft.c_str(), path_.c_str()) != 0) give_up(path_);
  at_step("state-replaced");
  size_ = components.size();
  named_ = realm;
}

// Whole or not at all: what is added later must not be a part of another's line.
void StateFile::add(const Process& component) {
  const shm::FileDescriptor file(open(path_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC));
  struct stat before {};
  if (!file || fstat(file.get(), &before) != 0) fail(errno, path_);
  if (!shm::write_whole(file.get(), line_of(component))) {
    const int error = errno;
    [[maybe_unused]] const int cut = ftruncate(file.get(), before.st_size);
    fail(error, path_);
  }
  at_step("component-written-down");
  ++size_;
}

void StateFile::remove() noexcept {
  unlink(path_.c_str());
  named_.reset();
}

}  // namespace arbiter::service
