#include "service/kept/state_file.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <fstream>
#include <system_error>

#include "service/kept/step.hpp"

namespace arbiter::service {

StateFile::StateFile(const std::string& directory, const std::string& instance)
    : path_(directory + "/" + instance + ".state") {}

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
  at_step("state-drafted");
  if (std::rename(draft.c_str(), path_.c_str()) != 0) {
    throw std::system_error(errno, std::generic_category(), "writing " + path_);
  }
  at_step("state-replaced");
  size_ = components.size();
}

void StateFile::add(const Process& component) noexcept {
  std::ofstream(path_, std::ios::app)
      << "component " << component.pid << ' ' << component.started << std::endl;
  at_step("component-written-down");
  ++size_;
}

void StateFile::remove() const noexcept { unlink(path_.c_str()); }

}  // namespace arbiter::service
