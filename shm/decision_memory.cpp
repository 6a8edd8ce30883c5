#include "shm/decision_memory.hpp"

#include <stdexcept>
#include <utility>

namespace arbiter::shm {

DecisionMemory::DecisionMemory(FileDescriptor board, Residence residence,
                               std::size_t max_page_descriptors)
    : residence_(residence),
      max_page_descriptors_(max_page_descriptors),
      board_descriptor_(std::move(board)) {
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
                              FileDescriptor page) {
  if (id >= kMaxSources) throw std::runtime_error("the daemon names a source beyond its limit");
  if (checked_size(page, Seals::kFixedSize) != sizeof(ActivityPage)) {
    throw std::runtime_error("an activity page has another size");
  }
  set_name(id, std::move(name));
  Page& place = mapped_[id][number % 2];
  if (place.number == 0) {
    place.mapping = Mapping(page, sizeof(ActivityPage), Access::kReadOnly);
    leave_behind(place.mapping);
  } else {
    pages_->vacate(id, number);
    place.mapping.replace(page);
  }
  place.number = number;
  const bool is_kept = place.descriptor || descriptors_kept_ < max_page_descriptors_;
  if (is_kept && !place.descriptor) ++descriptors_kept_;
  if (is_kept) {
    place.descriptor = std::move(page);
    close_in_children(place.descriptor);
  }
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

std::vector<DecisionMemory::PageAtHand> DecisionMemory::pages_at_hand() const {
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
  const bool is_watcher = max_page_descriptors_ == 0;
  if (is_watcher && texts.size() == 2) {
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
