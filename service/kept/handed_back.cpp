#include "service/kept/handed_back.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <stdexcept>

#include "shm/segment.hpp"

namespace arbiter::service {

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

}  // namespace arbiter::service
