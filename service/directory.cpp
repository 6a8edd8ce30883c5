#include "service/directory.hpp"

#include <fcntl.h>

#include <algorithm>
#include <stdexcept>

#include "service/inheritance.hpp"
#include "shm/limits.hpp"
#include "shm/table_ring.hpp"

namespace arbiter::service {
namespace {

// An entry that no table in the ring names, nor one that may come, and no live port.
template <class Entry>
Entry* find_unused(const std::vector<std::unique_ptr<Entry>>& entries, std::uint64_t generation) {
  for (const auto& entry : entries) {
    const bool named =
        entry->used_by_generation != 0 && generation - entry->used_by_generation < shm::kTableSlots;
    if (entry->open == 0 && entry->away == 0 && entry->pins == 0 && !named) return entry.get();
  }
  return nullptr;
}

std::string stored_name(shm::SourceId id) { return "page-" + std::to_string(id); }

[[noreturn]] void refuse(const char* what, std::uint32_t limit) {
  throw std::length_error("limit-exceeded: this instance has " + std::to_string(limit) + " " +
                          what + " already, the most there can be");
}

}  // namespace

void Directory::make_page(Source& source) {
  auto page = shm::make_segment("arbiter-activity", sizeof(shm::ActivityPage));
  if (const auto error = shm::allocate(page, 0, sizeof(shm::ActivityPage))) {
    throw std::system_error(error, "allocating an activity page");
  }
  shm::seal(page, shm::Seals::kFixedSize);
  use_page(source, std::move(page));
}

void Directory::use_page(Source& source, shm::FileDescriptor writable) {
  ++source.page_number;
  source.writable = std::move(writable);
  source.readable = shm::reopen(source.writable, O_RDONLY);
  source.page = shm::Mapping(source.writable, sizeof(shm::ActivityPage), shm::Access::kReadWrite);
}

void Directory::restore(std::uint64_t generation) {
  generation_ = generation;
  for (shm::SourceId id = 0; id < registry_.source_count(); ++id) {
    auto source = std::make_unique<Source>();
    source->id = id;
    const RegistryEntry& entry = registry_.source(id);
    if (entry.named.load(std::memory_order_acquire) != 0) {
      source->name = entry.name;
      source->used_by_generation = generation;
      source->away = entry.owner().port;
      source_ids_[source->name] = id;
    }
    sources_.push_back(std::move(source));
  }
  for (shm::PortId id = 0; id < registry_.input_count(); ++id) {
    auto input = std::make_unique<InputName>();
    input->id = id;
    const RegistryEntry& entry = registry_.input(id);
    if (entry.named.load(std::memory_order_acquire) != 0) {
      input->name = entry.name;
      input->name_number = 1;
      input->used_by_generation = generation;
      input->away = entry.owner().port;
      input_ids_[input->name] = id;
    }
    inputs_.push_back(std::move(input));
  }
}

bool Directory::take_page(shm::SourceId id, const shm::FileDescriptor& page) {
  Source* source = source_by_id(id);
  if (source == nullptr || source->name.empty() ||
      FileIdentity::of(page).inode != registry_.source(id).page.load(std::memory_order_acquire)) {
    return false;
  }
  if (source->has_page()) return true;
  use_page(*source, reopen_inherited(page, sizeof(shm::ActivityPage)));
  pages_->attach(id, &source->activity());
  return true;
}

bool Directory::take_page(const shm::FileDescriptor& page) {
  return std::any_of(sources_.begin(), sources_.end(),
                     [&](const auto& source) { return take_page(source->id, page); });
}

void Directory::forget_lost_pages() {
  for (const auto& source : sources_) {
    if (source->has_page() || source->away != 0 || source->name.empty()) continue;
    registry_.forget_source(source->id);
    source_ids_.erase(source->name);
    source->name.clear();
  }
}

Source& Directory::source(const std::string& name) {
  if (const auto found = source_ids_.find(name); found != source_ids_.end()) {
    return *sources_[found->second];
  }
  Source* source = nullptr;
  if (sources_.size() < shm::kMaxSources) {
    sources_.push_back(std::make_unique<Source>());
    source = sources_.back().get();
    source->id = static_cast<shm::SourceId>(sources_.size() - 1);
  } else {
    source = find_unused(sources_, generation_);
    if (source == nullptr) refuse("sources (kMaxSources)", shm::kMaxSources);
  }
  // A page of its own: who had the old one open may still write there.
  make_page(*source);
  registry_.name_source(source->id, name, FileIdentity::of(source->writable).inode);
  if (stores_) {
    discard_stored(stored_name(source->id));
    store(stored_name(source->id), source->writable);
  }
  source_ids_.erase(source->name);
  source->used_by_generation = 0;
  source->name = name;
  source_ids_[name] = source->id;
  pages_->attach(source->id, &source->activity());
  return *source;
}

InputName& Directory::input(const std::string& name) {
  if (const auto found = input_ids_.find(name); found != input_ids_.end()) {
    return *inputs_[found->second];
  }
  InputName* input = nullptr;
  if (inputs_.size() < shm::kMaxInputPorts) {
    inputs_.push_back(std::make_unique<InputName>());
    input = inputs_.back().get();
    input->id = static_cast<shm::PortId>(inputs_.size() - 1);
  } else {
    input = find_unused(inputs_, generation_);
    if (input == nullptr) refuse("input ports (kMaxInputPorts)", shm::kMaxInputPorts);
    input_ids_.erase(input->name);
    input->used_by_generation = 0;
  }
  registry_.name_input(input->id, name);
  input->name = name;
  ++input->name_number;
  input_ids_[name] = input->id;
  return *input;
}

Source* Directory::find_source(const std::string& name) {
  const auto found = source_ids_.find(name);
  return found == source_ids_.end() ? nullptr : sources_[found->second].get();
}

Source* Directory::source_by_id(shm::SourceId id) {
  return id < sources_.size() ? sources_[id].get() : nullptr;
}

InputName* Directory::input_by_id(shm::PortId id) {
  return id < inputs_.size() ? inputs_[id].get() : nullptr;
}

Source* Directory::source_of(shm::PortInstance port) {
  const auto found = std::find_if(sources_.begin(), sources_.end(), [&](const auto& source) {
    return source->open == port || source->away == port;
  });
  return found == sources_.end() ? nullptr : found->get();
}

InputName* Directory::input_of(shm::PortInstance port) {
  const auto found = std::find_if(inputs_.begin(), inputs_.end(), [&](const auto& input) {
    return input->open == port || input->away == port;
  });
  return found == inputs_.end() ? nullptr : found->get();
}

}  // namespace arbiter::service
