#include "client/memory.hpp"

#include <stdexcept>
#include <utility>

namespace arbiter::detail {

SharedMemory::SharedMemory(shm::FileDescriptor board, shm::FileDescriptor registry,
                           std::shared_ptr<const ServiceBell> service_bell,
                           shm::Residence residence)
    : service_bell_(std::move(service_bell)),
      residence_(residence),
      board_descriptor_(std::move(board)),
      registry_(std::move(registry)) {
  const std::size_t size = shm::checked_size(board_descriptor_, shm::Seals::kFixedSize);
  if (size != sizeof(shm::Board)) throw std::runtime_error("the daemon's board has another size");
  board_ = shm::Mapping(board_descriptor_, size, shm::Access::kReadOnly);
  leave_behind(board_);
  shm::close_in_children(board_descriptor_);
  shm::close_in_children(registry_);
  const auto* mapped = board_.as<const shm::Board>();
  if (mapped->magic != shm::Board::kMagic || mapped->version != shm::Board::kVersion) {
    throw std::runtime_error("the daemon is of another version");
  }
  tables_ = shm::TableReader(*mapped);
  pages_ = std::make_unique<shm::ActivityPages>(&tables_.pages());
  make_tables_resident();
}

void SharedMemory::make_tables_resident() const {
  shm::make_written_resident(board_descriptor_, board_, residence_);
}

void SharedMemory::add_page(shm::SourceId id, shm::PageNumber number, std::string name,
                            shm::FileDescriptor page) {
  if (id >= shm::kMaxSources)
    throw std::runtime_error("the daemon names a source beyond its limit");
  if (shm::checked_size(page, shm::Seals::kFixedSize) != sizeof(shm::ActivityPage)) {
    throw std::runtime_error("an activity page has another size");
  }
  set_name(id, std::move(name));
  Page& place = mapped_[id][number % 2];
  if (place.number == 0) {
    place.mapping = shm::Mapping(page, sizeof(shm::ActivityPage), shm::Access::kReadOnly);
    leave_behind(place.mapping);
  } else {
    pages_->vacate(id, number);
    place.mapping.replace(page);
  }
  place.number = number;
  const bool is_kept = place.descriptor || descriptors_kept_ < kMaxPageDescriptors;
  if (is_kept && !place.descriptor) ++descriptors_kept_;
  if (is_kept) {
    place.descriptor = std::move(page);
    shm::close_in_children(place.descriptor);
  }
  const auto attach = [&] {
    pages_->attach(id, number, &place.mapping.as<const shm::ActivityPage>()->of(id));
  };
  try {
    shm::make_resident(place.mapping, 0, sizeof(shm::ActivityPage), residence_);
  } catch (const std::system_error&) {
    attach();
    throw;
  }
  attach();
}

std::vector<SharedMemory::PageAtHand> SharedMemory::pages_at_hand() const {
  std::vector<PageAtHand> pages;
  for (const auto& [id, places] : mapped_) {
    for (const Page& page : places) {
      if (page.descriptor) pages.push_back({id, page.number, page.descriptor.get()});
    }
  }
  return pages;
}

// The daemon may be replaced while a child lives on.
void SharedMemory::leave_behind(const shm::Mapping& mapping) {
  bequests_.emplace_back(mapping.data(), mapping.size(), shm::Bequest::Kind::kNothing);
}

// Relaxed is enough, here and below: see names_.
void SharedMemory::set_name(shm::SourceId id, std::string name) {
  shm::Atomic<const std::string*>& known = (*names_)[id];
  const std::string* const before = known.load(std::memory_order_relaxed);
  if (before != nullptr && *before == name) return;
  known.store(&texts_.emplace_back(std::move(name)), std::memory_order_relaxed);
}

const std::string& SharedMemory::source_name(shm::SourceId id) const noexcept {
  if (!pages_->knows(id)) return unknown_;
  return *(*names_)[id].load(std::memory_order_relaxed);
}

}  // namespace arbiter::detail
