// What decisions read of the daemon's memory: its tables, the activity of sources, and their names.
#pragma once

#include <array>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "shm/activity_pages.hpp"
#include "shm/descendants.hpp"
#include "shm/file_descriptor.hpp"
#include "shm/residence.hpp"
#include "shm/segment.hpp"
#include "shm/table_ring.hpp"

namespace arbiter::shm {

// Thread safety: one thread adds pages and names; every thread reads. But for a watcher's names:
// only the thread that adds reads them.
class DecisionMemory {
 public:
  // A component keeps the descriptors of pages for the daemon's successor, as far as its limit
  // allows; a watcher hands nothing back.
  enum class Whose : std::uint8_t { kComponents, kWatchers };

  // Throws std::system_error, std::runtime_error.
  DecisionMemory(FileDescriptor board, Residence residence, Whose whose);

  // Of the daemon's memory what the data path reads, as far as it has been written by now: the
  // tables, the next one among them. Throws std::system_error.
  void make_tables_resident() const;
  // The source's page of that number, in force or to come. A page that cannot be locked is used
  // nevertheless: std::system_error is thrown once it is. One that cannot be mapped stays the
  // caller's.
  void add_page(SourceId id, PageNumber number, std::string name, FileDescriptor&& page);
  // Wait-free. The string stays as it is for as long as this lives; a watcher's until its id has
  // been given to two more names.
  [[nodiscard]] const std::string& source_name(SourceId id) const noexcept;

  // The thread that adds: what a daemon that takes over is handed back.
  [[nodiscard]] const FileDescriptor& board() const noexcept { return board_descriptor_; }
  struct PageAtHand {
    SourceId source = kNone;
    PageNumber number = 0;
    int descriptor = -1;
  };
  [[nodiscard]] std::vector<PageAtHand> pages_at_hand();

  [[nodiscard]] const TableReader& tables() const noexcept { return tables_; }
  [[nodiscard]] const ActivityPages& pages() const noexcept { return *pages_; }
  // Of all that it maps.
  [[nodiscard]] Residence residence() const noexcept { return residence_; }

 private:
  struct Page;

  void set_name(SourceId id, std::string name);
  void keep(Page& place, FileDescriptor page);
  void drop_former();
  void leave_behind(const Mapping& mapping);

  const Residence residence_;
  const Whose whose_;
  FileDescriptor board_descriptor_;
  Mapping board_;
  TableReader tables_;
  std::unique_ptr<ActivityPages> pages_;
  // The last two pages of each source, by their number: a page takes the place of the one before
  // the last, which nobody reads any more. So nothing needs to be unmapped under a port's thread,
  // and no source costs more than two, however often its page changes.
  struct Page {
    PageNumber number = 0;
    SegmentIdentity identity;
    Mapping mapping;
    FileDescriptor descriptor;  // none where there was no room to keep it
  };
  std::map<SourceId, std::array<Page, 2>> mapped_;
  std::list<Bequest> bequests_;  // of all of these mappings

  // A name is stored before its source's page is attached, and is looked for once the page has been
  // found: page-attached orders the two. An id that gets another name keeps those before it in
  // being, for ports' threads and programs hold them (Sample::source()). A component can afford
  // that: it is told of nothing but its own ports and what the models connect them to, so that the
  // names of others do not cost it anything. A watcher is told each name that anybody opens a port
  // by, without end: it keeps the last two of each id.
  using Names = std::array<Atomic<const std::string*>, kMaxSources>;
  const std::string unknown_ = "a source that this program does not know";
  std::map<SourceId, std::list<std::string>> texts_;  // the last name last; they never move
  std::unique_ptr<Names> names_ = std::make_unique<Names>();
};

}  // namespace arbiter::shm
