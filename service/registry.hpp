// What one daemon leaves to the next: whose every name is, and the numbers given so far.
//
// A segment beside the board. The daemon alone reads and writes it; its clients keep a read-only
// descriptor of it, and hand it to a successor, so that names keep their ids, live ports their
// numbers, and a port that a live component has open is given to nobody else.
//
// A daemon may be killed between any two stores. Each entry has one word that makes it count, which
// is stored last, and cleared first.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <string>

#include "service/inheritance.hpp"
#include "shm/atomic.hpp"
#include "shm/ids.hpp"
#include "shm/limits.hpp"
#include "shm/segment.hpp"

namespace arbiter::service {

// A component's conversation with the daemon, and those that carry it on after a loss. Never given
// twice.
using NodeId = std::uint64_t;

// Who has a port open.
struct Owner {
  shm::PortInstance port = 0;  // 0: nobody
  NodeId node = 0;
  Process process;
};

struct RegistryEntry {
  shm::Atomic<std::uint64_t> page;  // of a source: the inode of its activity page
  shm::Atomic<std::uint64_t> port;  // not 0: the owner counts
  shm::Atomic<std::uint64_t> node;
  shm::Atomic<std::uint64_t> pid;
  shm::Atomic<std::uint64_t> started;
  shm::Atomic<std::uint32_t> named;  // 1: the name counts
  char name[shm::kMaxNameLength + 1];

  [[nodiscard]] Owner owner() const noexcept;
  void set_owner(const Owner& owner) noexcept;
  void clear_owner() noexcept { port.store(0, std::memory_order_release); }
};

class Registry {
 public:
  // An empty one. Throws std::system_error.
  Registry();
  // A predecessor's. Throws std::runtime_error saying what is wrong with it.
  explicit Registry(const shm::FileDescriptor& handed_back);

  [[nodiscard]] std::uint64_t next_instance() noexcept;
  [[nodiscard]] std::uint64_t next_link() noexcept;
  [[nodiscard]] NodeId next_node() noexcept;

  // Throw std::system_error where there is no memory.
  void name_source(shm::SourceId id, const std::string& name, std::uint64_t page);
  void name_input(shm::PortId id, const std::string& name);
  void forget_source(shm::SourceId id) noexcept;
  // That a name has been given.
  [[nodiscard]] RegistryEntry& source(shm::SourceId id) const noexcept;
  [[nodiscard]] RegistryEntry& input(shm::PortId id) const noexcept;
  // What the model of a generation is called. The generation in force says which of them counts, so
  // it is to be told before that. Kept for as many as the board keeps tables.
  void name_model(std::uint64_t generation, const std::string& name) noexcept;
  [[nodiscard]] std::string model(std::uint64_t generation) const;
  // Up to which ids names have been given.
  [[nodiscard]] std::uint32_t source_count() const noexcept;
  [[nodiscard]] std::uint32_t input_count() const noexcept;

  // Read-only, for clients.
  [[nodiscard]] const shm::FileDescriptor& readable() const noexcept { return readable_; }
  [[nodiscard]] const shm::FileDescriptor& writable() const noexcept { return writable_; }

 private:
  struct Segment;
  void name(RegistryEntry& entry, const std::string& name, std::uint64_t page);
  [[nodiscard]] Segment& segment() const noexcept;

  shm::FileDescriptor writable_;
  shm::FileDescriptor readable_;
  shm::Mapping mapping_;
};

}  // namespace arbiter::service
