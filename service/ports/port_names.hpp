// Who is who: the ids of sources and input ports, and the activity page of each source.
//
// A name keeps its id for as long as a model (in force, or loaded), a live port or running activity
// needs it, across models and daemons. Then it is given back, with its page; its id is given to
// another name only when there is no new one left. What a successor must know stands in the
// registry, and which page of a source is in force, on the board.
//
// A page never passes from one user to another (shm/activity_pages.hpp): prepare_page() makes
// another, change_page() puts it in force.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "service/kept/registry.hpp"
#include "service/policy/shares.hpp"
#include "service/ports/closed_ports.hpp"
#include "service/ports/tables_in_use.hpp"
#include "shm/activity.hpp"
#include "shm/decision.hpp"
#include "shm/ids.hpp"
#include "shm/segment.hpp"
#include "shm/table_ring.hpp"

namespace arbiter::service {

// An activity page.
inline constexpr std::uint64_t kDescriptorsOfPage = 2;
struct Page {
  shm::FileDescriptor writable;  // for the one that has the output port open
  shm::FileDescriptor readable;  // for all others
  shm::Mapping mapping;

  explicit operator bool() const { return static_cast<bool>(writable); }
};

struct Source {
  shm::SourceId id = shm::kNone;
  std::string name;                      // empty: the id is nobody's
  Page page;                             // in force
  Page next;                             // that readers are being shown, if there is to be another
  shm::PageNumber page_number = 0;       // of the page in force; goes on from name to name
  PageUser page_user;                    // who else can write it, be it that he has closed
  std::uint64_t used_by_generation = 0;  // the last model that named it
  std::uint32_t pins = 0;                // of layouts of models that may come into force
  shm::PortInstance open = 0;            // the live output port, if any
  shm::PortInstance away = 0;            // of a component that lives and has not come back yet
  std::uint64_t news = 0;                // its number among what observers are told
  std::uint64_t changing_for = 0;        // the client for whom the next page is being shown
  shm::Nanoseconds promised_until = 0;   // to who has asked a port that yields: none gets it before
  Charge charge;       // of the user for whom the name is kept, or the daemon's own
  Charge page_charge;  // of who can write the page
  Charge next_charge;

  // After a restart nobody may have handed back the page yet.
  [[nodiscard]] bool has_page() const { return static_cast<bool>(page); }
  [[nodiscard]] shm::Activity& activity() const { return activity_on(page); }
  [[nodiscard]] shm::Activity& activity_on(const Page& of) const {
    return of.mapping.as<shm::ActivityPage>()->of(id);
  }
};

struct InputName {
  shm::PortId id = shm::kNone;
  std::string name;
  std::uint64_t news = 0;
  std::uint64_t used_by_generation = 0;
  std::uint32_t pins = 0;
  shm::PortInstance open = 0;
  shm::PortInstance away = 0;
  Charge charge;
};

class PortNames {
 public:
  // `stores`: whether activity pages go into the service manager's store too.
  PortNames(Registry& registry, Shares& shares, bool stores)
      : registry_(registry), shares_(shares), stores_(stores) {}

  // Where it says which pages are in force.
  void use_board(const shm::TableWriter& board) { board_ = board; }
  // Takes up what a predecessor has registered; pages come by take_page().
  void restore(const TablesInUse& tables);
  // One page that somebody hands back. False: it is not the page in force of that source.
  // Throws std::runtime_error where it is none that a daemon of ours has made. `is_stored`: the
  // service manager has it.
  bool take_page(shm::SourceId id, const shm::FileDescriptor& page, bool is_stored = false);
  // The same of one that the service manager has kept, under the name that it was given.
  bool take_stored_page(const std::string& name, const shm::FileDescriptor& page);
  // Of a source whose page nobody has, and whose publisher is gone: another page takes the place of
  // the lost one, under the next number, which no old page has. Nobody's activity is on it. Throws
  // std::system_error.
  void replace_lost_page(Source& source);
  // Does so for the sources that the table in force names by their ids, so that they go on being
  // the same. True: for one at least. `lost`: to those is added who may have been active for ever.
  // Throws std::system_error.
  bool replace_lost_pages(const shm::TableView& table, std::vector<std::string>& lost);
  // Gives up the names of the others: used again, they get another id.
  void forget_lost_pages(const shm::TableView& table);

  // Whether a user may be given the page in force, to write it: if no other has ever been.
  [[nodiscard]] static bool may_be_given(const Source& source, uid_t user) {
    return !source.page_user || *source.page_user == user;
  }
  // Before it is given to him.
  void give_page(Source& source, uid_t user);
  // Makes the next page, if there is none yet; nobody's activity is on it. Throws LimitExceeded,
  // std::system_error.
  void prepare_page(Source& source, PageUser user);
  // The next page takes the place of the one in force, and carries on its activity. `user`: who
  // will be given it.
  void change_page(Source& source, PageUser user);

  // Gives back the names that nobody needs. When to call it again, if nothing happens before.
  shm::Nanoseconds give_back(shm::Nanoseconds now);
  // Somebody has ceased to need the name.
  void let_go(const Source& source) { let_go_sources_.insert(source.id); }
  void let_go(const InputName& input) { let_go_inputs_.insert(input.id); }
  void let_go_all();

  // The source of that name, made if need be: for that user, or for a model. Throws
  // std::length_error naming the limit where there are too many, or the user has too many;
  // std::system_error where a page cannot be made.
  Source& source(const std::string& name, PageUser user = {});
  InputName& input(const std::string& name, PageUser user = {});

  [[nodiscard]] Source* find_source(const std::string& name);
  [[nodiscard]] Source* source_by_id(shm::SourceId id);
  [[nodiscard]] InputName* input_by_id(shm::PortId id);
  // Who has, or had and may come back to, that port.
  [[nodiscard]] Source* source_of(shm::PortInstance port);
  [[nodiscard]] const std::vector<std::unique_ptr<Source>>& sources() const { return sources_; }
  [[nodiscard]] const std::vector<std::unique_ptr<InputName>>& inputs() const { return inputs_; }
  // Names and pages in the order in which they were made, or replaced, by a number that grows.
  struct News {
    bool is_source = false;
    std::uint32_t id = 0;
  };
  [[nodiscard]] const std::map<std::uint64_t, News>& news() const { return news_; }
  [[nodiscard]] std::uint64_t last_news() const { return last_news_; }
  [[nodiscard]] const shm::ActivityPages& pages() const { return *pages_; }
  // Pages of names that are forgotten, and ports that had names.
  [[nodiscard]] ClosedPorts& closed() { return closed_; }
  [[nodiscard]] const ClosedPorts& closed() const { return closed_; }

  // The generation in force, which says what is no longer used.
  void set_generation(std::uint64_t generation) {
    generation_ = generation;
    let_go_all();
  }

 private:
  [[nodiscard]] Page make_page() const;
  [[nodiscard]] Page use_page(shm::FileDescriptor writable) const;
  [[nodiscard]] static bool has_lost_page(const Source& source);
  Source& unused_source();
  InputName& unused_input();
  void forget(Source& source);
  void forget(InputName& input);
  void announce(Source& source);
  void announce(InputName& input);
  [[nodiscard]] Charge take(PageUser user, Share what, std::uint64_t amount = 1) {
    return user ? shares_.take(*user, what, amount) : shares_.take_own(what, amount);
  }
  template <class Entry>
  [[nodiscard]] bool is_needed(const Entry& entry) const;
  template <class Id, class Entry>
  Entry* take_free(std::deque<Id>& free, const std::vector<std::unique_ptr<Entry>>& entries) const;
  void store_page(const Source& source, const Page& page, shm::PageNumber number) const;
  void discard_page(const Source& source, shm::PageNumber number) const;

  Registry& registry_;
  Shares& shares_;
  shm::TableWriter board_;
  const bool stores_;
  std::vector<std::unique_ptr<Source>> sources_;  // by id
  std::vector<std::unique_ptr<InputName>> inputs_;
  std::map<std::string, shm::SourceId> source_ids_;
  std::map<std::string, shm::PortId> input_ids_;
  std::deque<shm::SourceId> free_sources_;  // ids that have had a name, the longest free first
  std::deque<shm::PortId> free_inputs_;
  std::set<shm::SourceId> let_go_sources_;  // of which some may not be needed any more
  std::set<std::pair<shm::Nanoseconds, shm::SourceId>>
      running_out_;  // only their activity, or a promise, needs it
  std::set<shm::PortId> let_go_inputs_;
  std::unique_ptr<shm::ActivityPages> pages_ = std::make_unique<shm::ActivityPages>();
  std::uint64_t generation_ = 0;
  std::map<std::uint64_t, News> news_;
  std::uint64_t last_news_ = 0;
  ClosedPorts closed_;
};

}  // namespace arbiter::service
