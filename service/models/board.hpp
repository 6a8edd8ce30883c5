// The board that all clients map: which table is in force, and which comes next.
#pragma once

#include <cstdint>
#include <string>

#include "service/models/library.hpp"
#include "service/ports/port_names.hpp"
#include "shm/segment.hpp"
#include "shm/table_ring.hpp"

namespace arbiter::service {

class Board {
 public:
  // An empty board. Throws std::system_error.
  Board(PortNames& names, Registry& registry);

  // A predecessor's board takes the place of the empty one, which nobody has been given yet. Throws
  // std::runtime_error where it is not one.
  void inherit(const shm::FileDescriptor& board);

  // So that tables of that many words can be written at any time. Throws std::system_error.
  void reserve(std::size_t words);
  // Writes a model's table behind the ones in use; put_in_force() makes it count. `name`: what a
  // successor will know it by. Throws std::system_error; then nothing has changed.
  void prepare(const Layout& layout, const std::string& name);
  void put_in_force();

  [[nodiscard]] shm::TableSnapshot in_force() const { return reader_.snapshot(); }
  [[nodiscard]] TablesInUse in_use() const { return TablesInUse(*mapping_.as<shm::Board>()); }
  // The name of the one in force, be it a predecessor's; empty where there is none.
  [[nodiscard]] std::string name() const;
  // Since when it is; 0 where a predecessor has put it in force.
  [[nodiscard]] shm::Nanoseconds in_force_since() const { return in_force_since_; }
  [[nodiscard]] shm::TableView prepared() const { return writer_.next_table(); }
  // Read-only, for clients.
  [[nodiscard]] const shm::FileDescriptor& readable() const { return readable_; }
  [[nodiscard]] const shm::FileDescriptor& writable() const { return writable_; }

 private:
  PortNames& names_;
  Registry& registry_;
  shm::Nanoseconds in_force_since_ = 0;
  shm::FileDescriptor writable_;
  shm::FileDescriptor readable_;
  shm::Mapping mapping_;
  shm::TableWriter writer_;
  shm::TableReader reader_;
};

}  // namespace arbiter::service
