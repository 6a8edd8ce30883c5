// The model in force: read, proved, compiled and written into the board that all clients map.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "rules/compile.hpp"
#include "rules/load.hpp"
#include "service/directory.hpp"
#include "shm/segment.hpp"
#include "shm/table_ring.hpp"

namespace arbiter::service {

// A model that was refused; the findings have been logged.
class BadModel : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Models {
 public:
  // Throws std::system_error.
  Models(rules::ModelFiles files, Directory& directory);

  // A predecessor's board takes the place of the empty one, which nobody has been given yet. Throws
  // std::runtime_error where it is not one.
  void inherit(const shm::FileDescriptor& board);

  // Reads and proves the files. Logs every finding. Throws BadModel; then nothing has changed.
  void read();
  // Writes the table of what was read behind the ones in use; put_in_force() makes it count. Throws
  // BadModel, std::system_error; then nothing has changed.
  void prepare();
  void put_in_force();

  [[nodiscard]] shm::TableSnapshot in_force() const { return reader_.snapshot(); }
  // What the model in force was made of. Null: a predecessor has read it, and we have read no other
  // since.
  [[nodiscard]] const std::shared_ptr<const rules::ModelTexts>& texts_in_force() const {
    return texts_in_force_;
  }
  // Since when; 0 where a predecessor has put it in force.
  [[nodiscard]] shm::Nanoseconds in_force_since() const { return in_force_since_; }
  [[nodiscard]] shm::TableView prepared() const { return writer_.next_table(); }
  // Read-only, for clients.
  [[nodiscard]] const shm::FileDescriptor& board() const { return readable_; }
  [[nodiscard]] const shm::FileDescriptor& writable_board() const { return writable_; }
  [[nodiscard]] const rules::ModelFiles& files() const { return files_; }
  [[nodiscard]] bool has_files() const { return !files_.models.empty() || files_.application; }

 private:
  rules::ModelFiles files_;
  Directory& directory_;
  rules::CompiledModel compiled_;
  std::shared_ptr<const rules::ModelTexts> texts_in_force_;
  shm::Nanoseconds in_force_since_ = 0;
  shm::FileDescriptor writable_;
  shm::FileDescriptor readable_;
  shm::Mapping mapping_;
  shm::TableWriter writer_;
  shm::TableReader reader_;
};

}  // namespace arbiter::service
