// What one daemon leaves to the next: whose every name is, and the numbers given so far.
//
// A segment beside the board. The daemon alone reads and writes it; its clients keep a read-only
// descriptor of it, and hand it to a successor, so that names keep their ids, live ports their
// numbers, and a port that a live component has open is given to nobody else.
//
// A daemon may be killed between any two stores (registry_entry.hpp). The numbers given so far are
// stored before what they are given to is: relaxed is enough, for a successor reads them when their
// writer is gone.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "service/kept/registry_entry.hpp"
#include "shm/atomic.hpp"
#include "shm/ids.hpp"
#include "shm/limits.hpp"
#include "shm/segment.hpp"

namespace arbiter::service {

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
  void reserve_source(shm::SourceId id);  // before anything is said of it
  void reserve_input(shm::PortId id);
  void name_source(shm::SourceId id, const std::string& name) noexcept;
  void name_input(shm::PortId id, const std::string& name) noexcept;
  void forget_source(shm::SourceId id) noexcept;
  void forget_input(shm::PortId id) noexcept;
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
  void reserve(RegistryEntry& entry);
  [[nodiscard]] Segment& segment() const noexcept;

  shm::FileDescriptor writable_;
  shm::FileDescriptor readable_;
  shm::Mapping mapping_;
};

}  // namespace arbiter::service
