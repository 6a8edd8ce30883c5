// What all ports of a node see of the daemon: the tables, and the activity of sources.
#pragma once

#include <array>
#include <deque>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/service_bell.hpp"
#include "shm/decision.hpp"
#include "shm/descendants.hpp"
#include "shm/file_descriptor.hpp"
#include "shm/residence.hpp"
#include "shm/segment.hpp"
#include "shm/table_ring.hpp"

namespace arbiter::detail {

// Whether a port's decisions have missed a source that the port cannot see, which its component
// should know once. Begins at most once.
class Blindness {
 public:
  // Port's thread. True once.
  bool begins() noexcept {
    if (begun_.load(std::memory_order_relaxed)) return false;
    begun_.store(true, std::memory_order_relaxed);
    return true;
  }
  // Service thread. True once, after it has begun. Relaxed is enough: nothing is read by it.
  bool is_news() noexcept {
    return begun_.load(std::memory_order_relaxed) && !std::exchange(told_, true);
  }

 private:
  shm::Atomic<bool> begun_{false};
  bool told_ = false;
};

// Thread safety: the service thread adds pages and names; every thread reads.
class SharedMemory {
 public:
  // The registry is kept for the daemon's successor. Throws std::system_error, std::runtime_error.
  SharedMemory(shm::FileDescriptor board, shm::FileDescriptor registry,
               std::shared_ptr<const ServiceBell> service_bell,
               shm::Residence residence = shm::Residence::kMapped);

  // Of the daemon's memory what the data path reads, as far as it has been written by now: the
  // tables, the next one among them. Throws std::system_error.
  void make_tables_resident() const;
  // The source's page of that number, in force or to come. A page that cannot be locked is used
  // nevertheless: std::system_error is thrown once it is.
  void add_page(shm::SourceId id, shm::PageNumber number, std::string name,
                shm::FileDescriptor page);
  // Wait-free. The string stays as it is for as long as this lives.
  [[nodiscard]] const std::string& source_name(shm::SourceId id) const noexcept;

  // Service thread: what a daemon that takes over is handed back.
  [[nodiscard]] const shm::FileDescriptor& board() const noexcept { return board_descriptor_; }
  [[nodiscard]] const shm::FileDescriptor& registry() const noexcept { return registry_; }
  struct PageAtHand {
    shm::SourceId source = shm::kNone;
    shm::PageNumber number = 0;
    int descriptor = -1;
  };
  [[nodiscard]] std::vector<PageAtHand> pages_at_hand() const;

  [[nodiscard]] const shm::TableReader& tables() const noexcept { return tables_; }
  [[nodiscard]] const shm::ActivityPages& pages() const noexcept { return *pages_; }
  [[nodiscard]] const ServiceBell& service_bell() const noexcept { return *service_bell_; }
  // Of all that this node maps.
  [[nodiscard]] shm::Residence residence() const noexcept { return residence_; }

 private:
  // More need not be kept: others have them too, and a process has 1024 descriptors by default.
  static constexpr std::size_t kMaxPageDescriptors = 256;

  void set_name(shm::SourceId id, std::string name);
  void leave_behind(const shm::Mapping& mapping);

  const std::shared_ptr<const ServiceBell> service_bell_;
  const shm::Residence residence_;
  shm::FileDescriptor board_descriptor_;
  shm::FileDescriptor registry_;
  shm::Mapping board_;
  shm::TableReader tables_;
  std::unique_ptr<shm::ActivityPages> pages_;
  // The last two pages of each source, by their number: a page takes the place of the one before
  // the last, which nobody reads any more. So nothing needs to be unmapped under a port's thread,
  // and no source costs more than two, however often its page changes.
  struct Page {
    shm::PageNumber number = 0;
    shm::Mapping mapping;
    shm::FileDescriptor descriptor;  // none where too many are kept
  };
  std::map<shm::SourceId, std::array<Page, 2>> mapped_;
  std::size_t descriptors_kept_ = 0;
  std::list<shm::Bequest> bequests_;  // of all of these mappings

  // A name is stored before its source's page is attached, and is looked for once the page has been
  // found: page-attached orders the two. A source that gets another name keeps the old one in
  // being.
  using Names = std::array<shm::Atomic<const std::string*>, shm::kMaxSources>;
  const std::string unknown_ = "a source that this node does not know";
  std::deque<std::string> texts_;  // service thread; its strings never move
  std::unique_ptr<Names> names_ = std::make_unique<Names>();
};

}  // namespace arbiter::detail
