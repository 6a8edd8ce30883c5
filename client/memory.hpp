// What all ports of a node see of the daemon: the tables, and the activity of sources.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "client/service_bell.hpp"
#include "shm/decision.hpp"
#include "shm/segment.hpp"
#include "shm/table_ring.hpp"

namespace arbiter::detail {

// Thread safety: the service thread adds pages and names; every thread reads. Pages stay mapped for
// as long as this lives.
class SharedMemory {
 public:
  // Throws std::system_error, std::runtime_error.
  explicit SharedMemory(const shm::FileDescriptor& board);

  void add_page(shm::SourceId id, std::string name, const shm::FileDescriptor& page);
  [[nodiscard]] std::string source_name(shm::SourceId id) const;

  [[nodiscard]] const shm::TableReader& tables() const noexcept { return tables_; }
  [[nodiscard]] const shm::ActivityPages& pages() const noexcept { return *pages_; }
  [[nodiscard]] const ServiceBell& service_bell() const noexcept { return service_bell_; }

 private:
  ServiceBell service_bell_;
  shm::Mapping board_;
  shm::TableReader tables_;
  std::unique_ptr<shm::ActivityPages> pages_ = std::make_unique<shm::ActivityPages>();
  std::vector<shm::Mapping> mappings_;

  mutable std::mutex names_mutex_;
  std::map<shm::SourceId, std::string> names_;
};

}  // namespace arbiter::detail
