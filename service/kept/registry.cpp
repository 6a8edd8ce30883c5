#include "service/kept/registry.hpp"

#include <fcntl.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "service/kept/handed_back.hpp"
#include "service/kept/model_name.hpp"
#include "shm/table_ring.hpp"

namespace arbiter::service {

struct Registry::Segment {
  static constexpr std::uint64_t kMagic = 0x31676572'74696272;
  static constexpr std::uint32_t kVersion = 3;

  std::uint64_t magic;
  std::uint32_t version;
  shm::Atomic<std::uint64_t> last_instance;
  shm::Atomic<std::uint64_t> last_link;
  shm::Atomic<std::uint64_t> last_node;
  shm::Atomic<std::uint32_t> sources_named;
  shm::Atomic<std::uint32_t> inputs_named;
  char models[shm::kTableSlots][kMaxModelName + 1];
  RegistryEntry sources[shm::kMaxSources];
  RegistryEntry inputs[shm::kMaxInputPorts];
};

Registry::Registry() : writable_(shm::make_segment("arbiter-registry", sizeof(Segment))) {
  if (const auto error = shm::allocate(writable_, 0, offsetof(Segment, sources))) {
    throw std::system_error(error, "allocating the registry");
  }
  shm::seal(writable_, shm::Seals::kFixedSize);
  readable_ = shm::reopen(writable_, O_RDONLY);
  mapping_ = shm::Mapping(writable_, sizeof(Segment), shm::Access::kReadWrite);
  segment().magic = Segment::kMagic;
  segment().version = Segment::kVersion;
}

Registry::Registry(const shm::FileDescriptor& handed_back)
    : writable_(reopen_inherited(handed_back, sizeof(Segment))),
      readable_(shm::reopen(writable_, O_RDONLY)),
      mapping_(writable_, sizeof(Segment), shm::Access::kReadWrite) {
  if (segment().magic != Segment::kMagic || segment().version != Segment::kVersion) {
    throw std::runtime_error("the registry is one of another version");
  }
}

Registry::Segment& Registry::segment() const noexcept { return *mapping_.as<Segment>(); }

namespace {

std::uint64_t next(shm::Atomic<std::uint64_t>& last) noexcept {
  const std::uint64_t given = last.load(std::memory_order_relaxed) + 1;
  last.store(given, std::memory_order_relaxed);
  return given;
}

void count_up_to(shm::Atomic<std::uint32_t>& count, std::uint32_t id) noexcept {
  count.store(std::max(count.load(std::memory_order_relaxed), id + 1), std::memory_order_relaxed);
}

}  // namespace

std::uint64_t Registry::next_instance() noexcept { return next(segment().last_instance); }
std::uint64_t Registry::next_link() noexcept { return next(segment().last_link); }
NodeId Registry::next_node() noexcept { return next(segment().last_node); }

void Registry::reserve(RegistryEntry& entry) {
  const auto offset =
      static_cast<std::size_t>(reinterpret_cast<std::byte*>(&entry) - mapping_.data());
  if (const auto error = shm::allocate(writable_, offset, sizeof entry)) {
    throw std::system_error(error, "allocating the registry");
  }
}

void Registry::reserve_source(shm::SourceId id) { reserve(source(id)); }
void Registry::reserve_input(shm::PortId id) { reserve(input(id)); }

void Registry::name_source(shm::SourceId id, const std::string& name) noexcept {
  source(id).name(name);
  count_up_to(segment().sources_named, id);
}

void Registry::name_input(shm::PortId id, const std::string& name) noexcept {
  input(id).name(name);
  count_up_to(segment().inputs_named, id);
}

void Registry::forget_source(shm::SourceId id) noexcept { source(id).forget(); }
void Registry::forget_input(shm::PortId id) noexcept { input(id).forget(); }

// A name that cannot be one is of nobody: the segment may have been made by anyone of our user.
std::string Registry::model(std::uint64_t generation) const {
  const char* const text = segment().models[generation % shm::kTableSlots];
  std::string name(text, strnlen(text, kMaxModelName));
  return is_model_name(name) ? name : std::string();
}

void Registry::name_model(std::uint64_t generation, const std::string& name) noexcept {
  char* const text = segment().models[generation % shm::kTableSlots];
  const std::size_t length = std::min(name.size(), kMaxModelName);
  std::memcpy(text, name.data(), length);
  text[length] = '\0';
}

RegistryEntry& Registry::source(shm::SourceId id) const noexcept { return segment().sources[id]; }
RegistryEntry& Registry::input(shm::PortId id) const noexcept { return segment().inputs[id]; }

std::uint32_t Registry::source_count() const noexcept {
  return std::min(segment().sources_named.load(std::memory_order_relaxed), shm::kMaxSources);
}
std::uint32_t Registry::input_count() const noexcept {
  return std::min(segment().inputs_named.load(std::memory_order_relaxed), shm::kMaxInputPorts);
}

}  // namespace arbiter::service
