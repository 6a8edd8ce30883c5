#include "service/directory.hpp"

#include <fcntl.h>

#include <stdexcept>

#include "shm/limits.hpp"
#include "shm/table_ring.hpp"

namespace arbiter::service {
namespace {

void make_page(Source& source) {
  ++source.page_number;
  source.writable = shm::make_segment("arbiter-activity", sizeof(shm::ActivityPage));
  if (const auto error = shm::allocate(source.writable, 0, sizeof(shm::ActivityPage))) {
    throw std::system_error(error, "allocating an activity page");
  }
  shm::seal(source.writable, shm::Seals::kFixedSize);
  source.readable = shm::reopen(source.writable, O_RDONLY);
  source.page = shm::Mapping(source.writable, sizeof(shm::ActivityPage), shm::Access::kReadWrite);
}

// An entry that no table in the ring names, and no live port.
template <class Entry>
Entry* find_unused(const std::vector<std::unique_ptr<Entry>>& entries, std::uint64_t generation) {
  for (const auto& entry : entries) {
    const bool named =
        entry->used_by_generation != 0 && generation - entry->used_by_generation < shm::kTableSlots;
    if (entry->open == 0 && !named) return entry.get();
  }
  return nullptr;
}

[[noreturn]] void refuse(const char* what, std::uint32_t limit) {
  throw std::length_error("limit-exceeded: this instance has " + std::to_string(limit) + " " +
                          what + " already, the most there can be");
}

}  // namespace

Source& Directory::source(const std::string& name) {
  if (const auto found = source_ids_.find(name); found != source_ids_.end()) {
    return *sources_[found->second];
  }
  Source* source = nullptr;
  if (sources_.size() < shm::kMaxSources) {
    auto made = std::make_unique<Source>();
    make_page(*made);
    made->id = static_cast<shm::SourceId>(sources_.size());
    sources_.push_back(std::move(made));
    source = sources_.back().get();
  } else {
    source = find_unused(sources_, generation_);
    if (source == nullptr) refuse("sources (kMaxSources)", shm::kMaxSources);
    // A page of its own: who had the old one open may still write there.
    make_page(*source);
    source_ids_.erase(source->name);
    source->used_by_generation = 0;
  }
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

}  // namespace arbiter::service
