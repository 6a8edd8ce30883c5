#include "recorder/own_files.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdio>
#include <sstream>
#include <utility>

#include "shm/file_descriptor.hpp"

namespace arbiter::recorder {
namespace {

// Of so many files there can be a list; a longer one was not written here.
constexpr std::size_t kMostBytes = std::size_t{16} << 20;

std::string directory_of(const std::string& path) {
  const std::size_t slash = path.find_last_of('/');
  return slash == std::string::npos ? "" : path.substr(0, slash + 1);
}

// In a directory that others may write to, anything may stand under a name: only a file of this
// user's counts. Empty: there is none.
std::string content_of_own(const std::string& path) {
  const shm::FileDescriptor file(
      ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  struct stat there {};
  const bool is_own = file && ::fstat(file.get(), &there) == 0 && S_ISREG(there.st_mode) &&
                      there.st_uid == ::geteuid();
  if (!is_own || there.st_size > static_cast<off_t>(kMostBytes)) return "";
  std::string content(static_cast<std::size_t>(there.st_size), '\0');
  const ssize_t size = ::read(file.get(), content.data(), content.size());
  content.resize(size < 0 ? 0 : static_cast<std::size_t>(size));
  return content;
}

bool write_new(const std::string& path, const std::string& content) {
  const shm::FileDescriptor file(
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
  return file && ::write(file.get(), content.data(), content.size()) ==
                     static_cast<ssize_t>(content.size());
}

}  // namespace

OwnFiles::OwnFiles(std::string prefix, std::size_t most) : prefix_(std::move(prefix)), most_(most) {
  read_list();
}

std::optional<OwnFiles::File> OwnFiles::seen(const std::string& path) {
  struct stat now {};
  if (::lstat(path.c_str(), &now) != 0 || !S_ISREG(now.st_mode)) return std::nullopt;
  return File{path, now.st_dev, now.st_ino, now.st_size,
              std::int64_t{now.st_mtim.tv_sec} * 1'000'000'000 + now.st_mtim.tv_nsec};
}

std::vector<std::string> OwnFiles::add(const std::string& path) {
  if (auto made = seen(path)) files_.push_back(std::move(*made));
  forget_those_gone();
  std::vector<std::string> removed;
  while (files_.size() > most_) {
    if (::unlink(files_.front().path.c_str()) == 0) removed.push_back(files_.front().path);
    files_.pop_front();
  }
  write_list();
  return removed;
}

std::string OwnFiles::remove_oldest() {
  forget_those_gone();
  if (files_.size() < 2 || ::unlink(files_.front().path.c_str()) != 0) return "";
  std::string removed = std::move(files_.front().path);
  files_.pop_front();
  write_list();
  return removed;
}

void OwnFiles::forget_those_gone() {
  std::erase_if(files_, [](const File& file) { return seen(file.path) != file; });
}

// A line for each: its device, inode, size and time, and its name in the directory of the list. A
// line of an older recorder lacks two of these, and is passed over.
void OwnFiles::read_list() {
  const std::string directory = directory_of(prefix_);
  const std::string beginning = prefix_.substr(directory.size()) + "-";
  std::istringstream list(content_of_own(prefix_ + ".files"));
  for (std::string line; std::getline(list, line);) {
    std::istringstream words(line);
    File file;
    std::string name;
    const bool is_read = words >> file.device >> file.inode >> file.size >> file.modified &&
                         std::getline(words >> std::ws, name);
    if (!is_read) continue;
    const bool is_name = name.starts_with(beginning) && name.ends_with(".mcap") &&
                         name.find('/') == std::string::npos;
    if (!is_name) continue;
    file.path = directory + name;
    if (seen(file.path) == file) files_.push_back(std::move(file));
  }
}

void OwnFiles::write_list() const {
  const std::string list = prefix_ + ".files";
  const std::string next = list + ".new";
  const std::size_t directory = directory_of(prefix_).size();
  std::string text;
  for (const File& file : files_) {
    text += std::to_string(file.device) + ' ' + std::to_string(file.inode) + ' ' +
            std::to_string(file.size) + ' ' + std::to_string(file.modified) + ' ' +
            file.path.substr(directory) + '\n';
  }
  ::unlink(next.c_str());  // of a recorder that was killed
  if (!write_new(next, text) || std::rename(next.c_str(), list.c_str()) != 0) {
    ::unlink(next.c_str());
  }
}

}  // namespace arbiter::recorder
