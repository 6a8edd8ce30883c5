// Who is who: the ids of sources and input ports, and the activity page of each source.
//
// A name keeps its id for as long as a model or a live port uses it, across models, and in practice
// for ever; only where ids run out is one taken from a name that nobody uses any more.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "shm/activity.hpp"
#include "shm/decision.hpp"
#include "shm/ids.hpp"
#include "shm/segment.hpp"

namespace arbiter::service {

struct Source {
  shm::SourceId id = shm::kNone;
  std::string name;
  shm::FileDescriptor writable;  // for the one that has the output port open
  shm::FileDescriptor readable;  // for all others
  shm::Mapping page;
  std::uint64_t page_number = 0;         // another where an id got a page for another name
  std::uint64_t used_by_generation = 0;  // the last model that named it
  shm::PortInstance open = 0;            // the live output port, if any

  [[nodiscard]] shm::Activity& activity() const { return page.as<shm::ActivityPage>()->activity; }
};

struct InputName {
  shm::PortId id = shm::kNone;
  std::string name;
  std::uint64_t name_number = 0;  // another where an id got another name
  std::uint64_t used_by_generation = 0;
  shm::PortInstance open = 0;
};

class Directory {
 public:
  // The source of that name, made if need be. Throws std::length_error naming the limit where there
  // are too many, std::system_error where a page cannot be made.
  Source& source(const std::string& name);
  InputName& input(const std::string& name);

  [[nodiscard]] Source* find_source(const std::string& name);
  [[nodiscard]] Source* source_by_id(shm::SourceId id);
  [[nodiscard]] InputName* input_by_id(shm::PortId id);
  [[nodiscard]] const std::vector<std::unique_ptr<Source>>& sources() const { return sources_; }
  [[nodiscard]] const std::vector<std::unique_ptr<InputName>>& inputs() const { return inputs_; }
  [[nodiscard]] const shm::ActivityPages& pages() const { return *pages_; }

  // The generation in force, which says what is no longer used.
  void set_generation(std::uint64_t generation) { generation_ = generation; }

 private:
  std::vector<std::unique_ptr<Source>> sources_;  // by id
  std::vector<std::unique_ptr<InputName>> inputs_;
  std::map<std::string, shm::SourceId> source_ids_;
  std::map<std::string, shm::PortId> input_ids_;
  std::unique_ptr<shm::ActivityPages> pages_ = std::make_unique<shm::ActivityPages>();
  std::uint64_t generation_ = 0;
};

}  // namespace arbiter::service
