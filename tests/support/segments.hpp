// A component's own segments, mapped read-only from outside, and kept when it dies.
#pragma once

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "shm/input_segment.hpp"
#include "shm/output_segment.hpp"
#include "shm/segment.hpp"

namespace arbiter::test {

struct OwnOutput {
  shm::Mapping mapping;
  shm::OutputSegment segment;
};
struct OwnInput {
  shm::Mapping mapping;
  const shm::InputSegment* segment = nullptr;
};
struct OwnSegments {
  std::vector<OwnOutput> outputs;
  std::vector<OwnInput> inputs;
};

// What a process may write, by inode: its own. The segments of others pass through its descriptors
// too.
inline std::set<ino_t> writable_segments(pid_t process) {
  std::set<ino_t> own;
  std::ifstream maps("/proc/" + std::to_string(process) + "/maps");
  for (std::string line; std::getline(maps, line);) {
    std::istringstream words(line);
    std::string range, access, offset, device;
    ino_t inode = 0;
    words >> range >> access >> offset >> device >> inode;
    if (access == "rw-s" && line.find("/memfd:arbiter-") != std::string::npos) own.insert(inode);
  }
  return own;
}

inline OwnSegments map_segments_of(pid_t process) {
  OwnSegments result;
  std::set<ino_t> own = writable_segments(process);
  std::error_code gone;  // the process may have ended of itself: then it has said why
  const std::string directory = "/proc/" + std::to_string(process) + "/fd";
  for (const auto& entry : std::filesystem::directory_iterator(directory, gone)) {
    const std::string target = std::filesystem::read_symlink(entry.path(), gone).string();
    const bool output = target.rfind("/memfd:arbiter-output", 0) == 0;
    const bool input = target.rfind("/memfd:arbiter-input", 0) == 0;
    if (!output && !input) continue;
    const shm::FileDescriptor fd(::open(entry.path().c_str(), O_RDONLY | O_CLOEXEC));
    struct stat status {};
    if (!fd || ::fstat(fd.get(), &status) != 0 || own.erase(status.st_ino) == 0) continue;
    const std::size_t size = shm::checked_size(fd, shm::Seals::kOneWriter);
    shm::Mapping mapping(fd, size, shm::Access::kReadOnly);
    if (output) {
      const auto layout = shm::OutputLayout::checked(*mapping.as<shm::OutputHeader>(), size);
      const shm::OutputSegment segment(mapping.data(), layout);
      result.outputs.push_back({std::move(mapping), segment});
    } else {
      const auto* segment = mapping.as<const shm::InputSegment>();
      result.inputs.push_back({std::move(mapping), segment});
    }
  }
  return result;
}

// How many samples a queue has accepted since its reader joined. The ring is the truth: a publisher
// may have died between storing an entry and counting it.
inline std::uint64_t accepted_by(const shm::OutputSegment& segment, std::uint32_t index) {
  const shm::Channel& channel = segment.channel(index);
  const std::uint64_t before = channel.first.load() - 1;
  std::uint64_t last = before;
  const std::uint32_t depth = channel.depth.load();
  for (std::uint32_t i = 0; i < depth && i < shm::kMaxDepth; ++i) {
    last = std::max(last, shm::sequence_of(segment.ring(index, channel.receiver.load())[i].load()));
  }
  return last - before;
}

// Over all queues to one input port, by the id of its name.
inline std::uint64_t accepted_for(const shm::OutputSegment& segment, std::uint32_t port) {
  std::uint64_t sum = 0;
  for (std::uint32_t i = 0; i < shm::kMaxDestinations; ++i) {
    const shm::Channel& channel = segment.channel(i);
    if (channel.receiver.load() != 0 && channel.port.load() == port) sum += accepted_by(segment, i);
  }
  return sum;
}

}  // namespace arbiter::test
