// Who is who: the ids of sources and input ports, and the activity page of each source.
//
// A name keeps its id for as long as a model (in force, or loaded) or a live port uses it, across
// models and daemons, and in practice for ever; only where ids run out is one taken from a name
// that nobody uses any more. What a successor must know of it stands in the registry.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "service/registry.hpp"
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
  std::uint32_t pins = 0;                // of layouts of models that may come into force
  shm::PortInstance open = 0;            // the live output port, if any
  shm::PortInstance away = 0;            // of a component that lives and has not come back yet

  // After a restart nobody may have handed back the page yet.
  [[nodiscard]] bool has_page() const { return static_cast<bool>(writable); }
  [[nodiscard]] shm::Activity& activity() const { return page.as<shm::ActivityPage>()->of(id); }
};

struct InputName {
  shm::PortId id = shm::kNone;
  std::string name;
  std::uint64_t name_number = 0;  // another where an id got another name
  std::uint64_t used_by_generation = 0;
  std::uint32_t pins = 0;
  shm::PortInstance open = 0;
  shm::PortInstance away = 0;
};

class Directory {
 public:
  // `stores`: whether activity pages go into the service manager's store too.
  Directory(Registry& registry, bool stores) : registry_(registry), stores_(stores) {}

  // Takes up what a predecessor has registered; pages come by take_page().
  void restore(std::uint64_t generation);
  // One page that somebody hands back. False: it is not the page of that source.
  // Throws std::runtime_error where it is none that a daemon of ours has made.
  bool take_page(shm::SourceId id, const shm::FileDescriptor& page);
  bool take_page(const shm::FileDescriptor& page);  // of whichever source
  // Gives up the names of sources whose page nobody has, and whose publisher is gone: used again,
  // they get another id, so that who might still look at the old page sees nothing at all.
  void forget_lost_pages();

  // The source of that name, made if need be. Throws std::length_error naming the limit where there
  // are too many, std::system_error where a page cannot be made.
  Source& source(const std::string& name);
  InputName& input(const std::string& name);

  [[nodiscard]] Source* find_source(const std::string& name);
  [[nodiscard]] Source* source_by_id(shm::SourceId id);
  [[nodiscard]] InputName* input_by_id(shm::PortId id);
  // Who has, or had and may come back to, that port.
  [[nodiscard]] Source* source_of(shm::PortInstance port);
  [[nodiscard]] InputName* input_of(shm::PortInstance port);
  [[nodiscard]] const std::vector<std::unique_ptr<Source>>& sources() const { return sources_; }
  [[nodiscard]] const std::vector<std::unique_ptr<InputName>>& inputs() const { return inputs_; }
  [[nodiscard]] const shm::ActivityPages& pages() const { return *pages_; }

  // The generation in force, which says what is no longer used.
  void set_generation(std::uint64_t generation) { generation_ = generation; }

 private:
  void make_page(Source& source);
  void use_page(Source& source, shm::FileDescriptor writable);

  Registry& registry_;
  const bool stores_;
  std::vector<std::unique_ptr<Source>> sources_;  // by id
  std::vector<std::unique_ptr<InputName>> inputs_;
  std::map<std::string, shm::SourceId> source_ids_;
  std::map<std::string, shm::PortId> input_ids_;
  std::unique_ptr<shm::ActivityPages> pages_ = std::make_unique<shm::ActivityPages>();
  std::uint64_t generation_ = 0;
};

}  // namespace arbiter::service
