#include "shm/decision_memory.hpp"

#include <sys/resource.h>

#include <stdexcept>
#include <utility>

namespace arbiter::shm {
namespace {

// A quarter of what this process may have is left for its ports and for all else that it opens.
bool is_among_those_for_pages(const FileDescriptor& page) noexcept {
  rlimit limit{};
  return page && ::getrlimit(RLIMIT_NOFILE, &limit) == 0 &&
         static_cast<rlim_t>(page.get()) < limit.rlim_cur - limit.rlim_cur / 4;
}

}  // namespace

DecisionMemory::DecisionMemory(FileDescriptor board, Residence residence, Whose whose)
    : residence_(residence), whose_(whose), board_descriptor_(std::move(board)) {
  const std::size_t size = checked_size(board_descriptor_, Seals::kFixedSize);
  if (size != sizeof(Board)) throw std::runtime_error("the daemon's board has another size");
  board_ = Mapping(board_descriptor_, size, Access::kReadOnly);
  leave_behind(board_);
  close_in_children(board_descriptor_);
  const auto* mapped = board_.as<const Board>();
  if (mapped->magic != Board::kMagic || mapped->version != Board::kVersion) {
    throw std::runtime_error("the daemon is of another version");
  }
  tables_ = TableReader(*mapped);
  pages_ = std::make_unique<ActivityPages>(&tables_.pages());
  make_tables_resident();
}

void DecisionMemory::make_tables_resident() const {
  make_written_resident(board_descriptor_, board_, residence_);
}

void DecisionMemory::add_page(SourceId id, PageNumber number, std::string name,
                              FileDescriptor&& page) {
  if (id >= kMaxSources) throw std::runtime_error("the daemon names a source beyond its limit");
  if (checked_size(page, Seals::kFixedSize) != sizeof(ActivityPage)) {
    throw std::runtime_error("an activity page has another size");
  }
  set_name(id, std::move(name));
  Page& place = mapped_[id][number % 2];
  const SegmentIdentity identity = identity_of(page);
  if (place.number == number && place.identity == identity) {  // another daemon shows it again
    keep(place, std::move(page));
    return;
  }
  if (place.number == 0) {
    place.mapping = Mapping(page, sizeof(ActivityPage), Access::kReadOnly);
    leave_behind(place.mapping);
  } else {
    pages_->vacate(id, number);
    place.mapping.replace(page);
  }
  place.number = number;
  place.identity = identity;
  keep(place, std::move(page));
  const auto attach = [&] {
    pages_->attach(id, number, &place.mapping.as<const ActivityPage>()->of(id));
  };
  try {
    make_resident(place.mapping, 0, sizeof(ActivityPage), residence_);
  } catch (const std::system_error&) {
    attach();
    throw;
  }
  attach();
}

void DecisionMemory::keep(Page& place, FileDescriptor page) {
  place.descriptor.reset();
  if (whose_ == Whose::kWatchers) return;
  if (!is_among_those_for_pages(page)) {
    drop_former();
    page = duplicate(page.get());
  }
  if (!is_among_those_for_pages(page)) return;
  place.descriptor = std::move(page);
  close_in_children(place.descriptor);
}

// Those that are in force no longer: no daemon takes them back.
void DecisionMemory::drop_former() {
  for (auto& [id, places] : mapped_) {
    for (Page& page : places) {
      if (page.number < tables_.pages().of(id)) page.descriptor.reset();
    }
  }
}

std::vector<DecisionMemory::PageAtHand> DecisionMemory::pages_at_hand() {
  drop_former();
  std::vector<PageAtHand> pages;
  for (const auto& [id, places] : mapped_) {
    for (const Page& page : places) {
      if (page.descriptor) pages.push_back({id, page.number, page.descriptor.get()});
    }
  }
  return pages;
}

// The daemon may be replaced while a child lives on.
void DecisionMemory::leave_behind(const Mapping& mapping) {
  bequests_.emplace_back(mapping.data(), mapping.size(), Bequest::Kind::kNothing);
}

// Relaxed is enough, here and below: see names_. Of a watcher's names the one before the last makes
// room: nobody but this thread reads them.
void DecisionMemory::set_name(SourceId id, std::string name) {
  Atomic<const std::string*>& known = (*names_)[id];
  const std::string* const before = known.load(std::memory_order_relaxed);
  if (before != nullptr && *before == name) return;
  std::list<std::string>& texts = texts_[id];
  if (whose_ == Whose::kWatchers && texts.size() == 2) {
    texts.splice(texts.end(), texts, texts.begin());
    texts.back() = std::move(name);
  } else {
    texts.push_back(std::move(name));
  }
  known.store(&texts.back(), std::memory_order_relaxed);
}

const std::string& DecisionMemory::source_name(SourceId id) const noexcept {
  if (!pages_->knows(id)) return unknown_;
  return *(*names_)[id].load(std::memory_order_relaxed);
}

}  // namespace arbiter::shm
