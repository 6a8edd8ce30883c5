// A recording's file: read, and repaired. Whatever it holds, what is read of it is consistent, and
// what is made of it is whole and has the same.
#include <unistd.h>

#include <filesystem>
#include <set>

#include "recording/mcap.hpp"
#include "tests/fuzz/file_in_memory.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace arbiter::fuzz {
namespace {

constexpr std::size_t kMaxBytes = std::size_t{1} << 20;

struct Found {
  recording::McapEnd end;
  std::size_t messages = 0;
  std::size_t metadata = 0;
  std::size_t attachments = 0;
};

Found read(const std::string& path) {
  Found found;
  std::set<std::uint16_t> schemas{0};
  std::set<std::uint16_t> channels;
  recording::McapVisitor visitor;
  visitor.schema = [&](std::uint16_t id, const recording::McapSchema&) { schemas.insert(id); };
  visitor.channel = [&](std::uint16_t id, const recording::McapChannel& channel) {
    require(schemas.count(channel.schema) > 0, "a channel has its schema");
    channels.insert(id);
  };
  visitor.message = [&](const recording::McapMessage& message) {
    require(channels.count(message.channel) > 0, "a message has its channel");
    require(message.data.size() <= kMaxBytes, "a message is as long as it may be");
    ++found.messages;
  };
  visitor.metadata = [&](const std::string&, const recording::McapMap&) { ++found.metadata; };
  visitor.attachment = [&](const recording::McapAttachment&) { ++found.attachments; };
  visitor.chunk = [](const recording::McapChunkInfo& chunk) {
    require(chunk.uncompressed <= kMaxBytes, "a chunk is as long as it may be");
  };
  found.end = recording::read_mcap(path, visitor, kMaxBytes);
  require(found.end.is_whole == found.end.problem.empty(), "what is not whole has a problem");
  require(found.end.whole_bytes <= found.end.file_bytes, "what is whole is in the file");
  require(!found.end.is_whole || found.end.whole_bytes == found.end.file_bytes,
          "a whole file is whole to its end");
  return found;
}

void repair(const std::string& from, const Found& before) {
  // In memory: on a disk, making the new file durable would take most of the time.
  const std::filesystem::path memory("/dev/shm");
  const std::string to = (std::filesystem::exists(memory) ? memory : "/tmp") /
                         ("arbiter-fuzz-mcap-" + std::to_string(::getpid()));
  std::filesystem::remove(to);
  try {
    recording::repair_mcap(from, to, "fuzzer", kMaxBytes);
  } catch (const recording::McapError&) {
    require(!std::filesystem::exists(to), "a failed repair leaves no file");
    return;
  }
  const Found after = read(to);
  std::filesystem::remove(to);
  require(after.end.is_whole && after.end.has_summary, "what is repaired is whole");
  require(after.messages == before.messages && after.attachments == before.attachments &&
              after.metadata == before.metadata + 1,
          "what is repaired has the same");
}

void check(const std::string& content) {
  const FileInMemory file(content);
  Found found;
  try {
    found = read(file.path());
  } catch (const recording::McapError&) {
    return;
  }
  repair(file.path(), found);
}

}  // namespace
}  // namespace arbiter::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  arbiter::fuzz::check(arbiter::fuzz::text_of(data, size));
  return 0;
}
