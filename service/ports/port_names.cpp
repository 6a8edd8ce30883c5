#include "service/ports/port_names.hpp"

#include <fcntl.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "service/kept/descriptor_store.hpp"
#include "service/kept/handed_back.hpp"
#include "service/kept/step.hpp"
#include "shm/assertion.hpp"
#include "shm/limits.hpp"
#include "shm/segment.hpp"
#include "shm/table_ring.hpp"

namespace arbiter::service {
namespace {

constexpr std::string_view kStoredPage = "page-";

std::string stored_name(shm::SourceId id, shm::PageNumber number) {
  return std::string(kStoredPage) + std::to_string(id) + "-" + std::to_string(number);
}

// Whose page has that name.
std::optional<shm::SourceId> source_of_stored(const std::string& name) {
  if (!name.starts_with(kStoredPage)) return {};
  shm::SourceId id = 0;
  const auto read =
      std::from_chars(name.data() + kStoredPage.size(), name.data() + name.size(), id);
  return read.ec == std::errc() ? std::optional(id) : std::nullopt;
}

[[noreturn]] void refuse(const char* what, std::uint32_t limit) {
  throw std::length_error("limit-exceeded: this instance has " + std::to_string(limit) + " " +
                          what + " already, the most there can be");
}

}  // namespace

Page PortNames::make_page() const {
  auto page = shm::make_segment("arbiter-activity", sizeof(shm::ActivityPage));
  if (const auto error = shm::allocate(page, 0, sizeof(shm::ActivityPage))) {
    throw std::system_error(error, "allocating an activity page");
  }
  shm::seal(page, shm::Seals::kFixedSize);
  return use_page(std::move(page));
}

Page PortNames::use_page(shm::FileDescriptor writable) const {
  Page page;
  page.readable = shm::reopen(writable, O_RDONLY);
  page.mapping = shm::Mapping(writable, sizeof(shm::ActivityPage), shm::Access::kReadWrite);
  page.writable = std::move(writable);
  return page;
}

void PortNames::store_page(const Source& source, const Page& page, shm::PageNumber number) const {
  if (stores_) store(stored_name(source.id, number), page.writable);
}

void PortNames::discard_page(const Source& source, shm::PageNumber number) const {
  if (stores_) discard_stored(stored_name(source.id, number));
}

void PortNames::restore(const TablesInUse& tables) {
  generation_ = tables.newest();
  for (shm::SourceId id = 0; id < registry_.source_count(); ++id) {
    auto source = std::make_unique<Source>();
    source->id = id;
    source->page_number = board_.page_number(id);
    const RegistryEntry& entry = registry_.source(id);
    source->name = entry.name();
    if (source_ids_.contains(source->name)) source->name.clear();  // no daemon of ours writes that
    if (!source->name.empty()) {
      source->page_user = entry.page_user(source->page_number);
      source->used_by_generation = tables.last_naming(id, &shm::TableView::knows_source);
      source->away = entry.owner().port;
      source->charge = shares_.take_own(Share::kSources);
      source->page_charge = shares_.take_own(Share::kDescriptors, kDescriptorsOfPage);
      source_ids_[source->name] = id;
    } else {
      free_sources_.push_back(id);
    }
    sources_.push_back(std::move(source));
  }
  for (shm::PortId id = 0; id < registry_.input_count(); ++id) {
    auto input = std::make_unique<InputName>();
    input->id = id;
    const RegistryEntry& entry = registry_.input(id);
    input->name = entry.name();
    if (input_ids_.contains(input->name)) input->name.clear();
    if (!input->name.empty()) {
      input->used_by_generation = tables.last_naming(id, &shm::TableView::knows_port);
      input->away = entry.owner().port;
      input->charge = shares_.take_own(Share::kInputs);
      input_ids_[input->name] = id;
      announce(*input);
    } else {
      free_inputs_.push_back(id);
    }
    inputs_.push_back(std::move(input));
  }
  let_go_all();
}

bool PortNames::take_page(shm::SourceId id, const shm::FileDescriptor& page, bool is_stored) {
  Source* source = source_by_id(id);
  if (source == nullptr || source->name.empty() ||
      shm::identity_of(page).inode != registry_.source(id).page_inode(source->page_number)) {
    return false;
  }
  if (source->has_page()) return true;
  source->page = use_page(reopen_inherited(page, sizeof(shm::ActivityPage)));
  pages_->attach(id, &source->activity());
  announce(*source);
  if (!is_stored) store_page(*source, source->page, source->page_number);
  return true;
}

bool PortNames::take_stored_page(const std::string& name, const shm::FileDescriptor& page) {
  const auto id = source_of_stored(name);
  return id && take_page(*id, page, true);
}

bool PortNames::has_lost_page(const Source& source) {
  return !source.has_page() && source.away == 0 && !source.name.empty();
}

bool PortNames::replace_lost_pages(const shm::TableView& table, std::vector<std::string>& lost) {
  bool any = false;
  for (const auto& source : sources_) {
    if (!has_lost_page(*source) || !table.knows_source(source->id)) continue;
    const bool was_open = source->page_user.has_value();
    replace_lost_page(*source);
    if (was_open && table.timeout(source->id) == shm::kForever) lost.push_back(source->name);
    any = true;
  }
  return any;
}

void PortNames::forget_lost_pages(const shm::TableView& table) {
  for (const auto& source : sources_) {
    if (has_lost_page(*source) && !table.knows_source(source->id)) forget(*source);
  }
}

void PortNames::replace_lost_page(Source& source) {
  Page page = make_page();
  const shm::PageNumber number = source.page_number + 1;
  registry_.source(source.id).set_page(number, shm::identity_of(page.writable).inode, {});
  at_step("lost-page-registered");
  board_.give_page(source.id, number);
  at_step("lost-page-numbered");
  board_.renew_pages();
  at_step("lost-page-replaced");
  source.page = std::move(page);
  source.page_number = number;
  source.page_user.reset();
  pages_->attach(source.id, &source.activity());
  announce(source);
  store_page(source, source.page, number);
  at_step("lost-page-stored");
}

void PortNames::give_page(Source& source, uid_t user) {
  source.page_user = user;
  registry_.source(source.id).set_page_user(source.page_number, user);
  at_step("page-given");
}

void PortNames::prepare_page(Source& source, PageUser user) {
  if (source.next) return;
  Charge charge = take(user, Share::kDescriptors, kDescriptorsOfPage);
  source.next = make_page();
  at_step("next-page-made");
  source.next_charge = std::move(charge);
  store_page(source, source.next, source.page_number + 1);
  at_step("next-page-stored");
}

// A daemon that is killed here leaves one page in force or the other: the store to the board says
// which, and what the registry says of both is there before it.
void PortNames::change_page(Source& source, PageUser user) {
  const shm::PageNumber number = source.page_number + 1;
  registry_.source(source.id).set_page(number, shm::identity_of(source.next.writable).inode, user);
  at_step("next-page-registered");
  board_.change_page(source.id, source.activity(), source.activity_on(source.next));
  at_step("page-changed");
  source.page = std::exchange(source.next, {});
  source.page_charge = std::move(source.next_charge);
  source.page_number = number;
  source.page_user = user;
  pages_->attach(source.id, &source.activity());
  announce(source);
  discard_page(source, number - 1);
  at_step("former-page-discarded");
}

// Whom a table in the ring names, or one that may come, or a live port, or who is being changed.
template <class Entry>
bool PortNames::is_needed(const Entry& entry) const {
  const bool named =
      entry.used_by_generation != 0 && generation_ - entry.used_by_generation < shm::kTableSlots;
  return entry.open != 0 || entry.away != 0 || entry.pins != 0 || named;
}

void PortNames::let_go_all() {
  for (const auto& source : sources_) let_go(*source);
  for (const auto& input : inputs_) let_go(*input);
}

shm::Nanoseconds PortNames::give_back(shm::Nanoseconds now) {
  while (!running_out_.empty() && running_out_.begin()->first <= now) {
    let_go_sources_.insert(running_out_.begin()->second);
    running_out_.erase(running_out_.begin());
  }
  for (const shm::PortId id : std::exchange(let_go_inputs_, {})) {
    InputName& input = *inputs_[id];
    if (!input.name.empty() && !is_needed(input)) forget(input);
  }
  for (const shm::SourceId id : std::exchange(let_go_sources_, {})) {
    Source& source = *sources_[id];
    if (source.name.empty() || is_needed(source) || source.changing_for != 0) continue;
    if (now < source.promised_until) {
      running_out_.emplace(source.promised_until, id);
      continue;
    }
    const shm::ActivityWord word = source.has_page()
                                       ? source.activity().word.load(std::memory_order_relaxed)
                                       : shm::kNeverActive;
    if (!shm::is_active(word, now)) {
      forget(source);
    } else if (shm::is_finite(word)) {
      running_out_.emplace(word, id);
    }
  }
  return running_out_.empty() ? shm::kForever : running_out_.begin()->first;
}

void PortNames::forget(Source& source) {
  ARBITER_ASSERT(source.open == 0 && source.away == 0, "a source is forgotten that somebody has");
  registry_.forget_source(source.id);
  at_step("source-forgotten");
  discard_page(source, source.page_number);
  if (source.next) discard_page(source, source.page_number + 1);
  source_ids_.erase(source.name);
  news_.erase(source.news);
  pages_->attach(source.id, nullptr);
  source.name.clear();
  closed_.add(std::make_shared<Page>(std::exchange(source.page, {})));
  source.next = {};
  source.page_user.reset();
  source.promised_until = 0;
  source.charge = {};
  source.page_charge = {};
  source.next_charge = {};
  free_sources_.push_back(source.id);
}

void PortNames::forget(InputName& input) {
  ARBITER_ASSERT(input.open == 0 && input.away == 0, "a port is forgotten that somebody has");
  registry_.forget_input(input.id);
  at_step("input-forgotten");
  input_ids_.erase(input.name);
  news_.erase(input.news);
  input.name.clear();
  input.charge = {};
  free_inputs_.push_back(input.id);
}

void PortNames::announce(Source& source) {
  news_.erase(source.news);
  source.news = ++last_news_;
  news_[source.news] = {true, source.id};
}

void PortNames::announce(InputName& input) {
  news_.erase(input.news);
  input.news = ++last_news_;
  news_[input.news] = {false, input.id};
}

// An id that is nobody's, the longest free first; of those a table in the ring still names, none.
template <class Id, class Entry>
Entry* PortNames::take_free(std::deque<Id>& free,
                            const std::vector<std::unique_ptr<Entry>>& entries) const {
  const auto found =
      std::find_if(free.begin(), free.end(), [&](Id id) { return !is_needed(*entries[id]); });
  if (found == free.end()) return nullptr;
  Entry* const entry = entries[*found].get();
  free.erase(found);
  return entry;
}

Source& PortNames::unused_source() {
  if (sources_.size() < shm::kMaxSources) {
    const auto id = static_cast<shm::SourceId>(sources_.size());
    registry_.reserve_source(id);
    sources_.push_back(std::make_unique<Source>());
    sources_.back()->id = id;
    sources_.back()->page_number = board_.page_number(id);
    return *sources_.back();
  }
  Source* const source = take_free(free_sources_, sources_);
  if (source == nullptr) refuse("sources (kMaxSources)", shm::kMaxSources);
  return *source;
}

InputName& PortNames::unused_input() {
  if (inputs_.size() < shm::kMaxInputPorts) {
    const auto id = static_cast<shm::PortId>(inputs_.size());
    registry_.reserve_input(id);
    inputs_.push_back(std::make_unique<InputName>());
    inputs_.back()->id = id;
    return *inputs_.back();
  }
  InputName* const input = take_free(free_inputs_, inputs_);
  if (input == nullptr) refuse("input ports (kMaxInputPorts)", shm::kMaxInputPorts);
  return *input;
}

Source& PortNames::source(const std::string& name, PageUser user) {
  if (const auto found = source_ids_.find(name); found != source_ids_.end()) {
    Source& known = *sources_[found->second];
    if (!user) {  // what a model names costs nobody anything
      shares_.make_own(known.charge);
      shares_.make_own(known.page_charge);
    }
    return known;
  }
  Charge charge = take(user, Share::kSources);
  Charge page_charge = take(user, Share::kDescriptors, kDescriptorsOfPage);
  Page page = make_page();
  Source& source = unused_source();
  source.charge = std::move(charge);
  source.page_charge = std::move(page_charge);
  // A page of its own: who had the last one of this id open may still write there.
  const shm::PageNumber number = source.page_number + 1;
  registry_.source(source.id).set_page(number, shm::identity_of(page.writable).inode, {});
  at_step("first-page-registered");
  board_.give_page(source.id, number);
  at_step("first-page-numbered");
  registry_.name_source(source.id, name);
  at_step("source-named");
  source.page = std::move(page);
  source.page_number = number;
  store_page(source, source.page, number);
  at_step("first-page-stored");
  source.name = name;
  source.used_by_generation = 0;
  source_ids_[name] = source.id;
  pages_->attach(source.id, &source.activity());
  announce(source);
  return source;
}

InputName& PortNames::input(const std::string& name, PageUser user) {
  if (const auto found = input_ids_.find(name); found != input_ids_.end()) {
    InputName& known = *inputs_[found->second];
    if (!user) shares_.make_own(known.charge);
    return known;
  }
  Charge charge = take(user, Share::kInputs);
  InputName& input = unused_input();
  input.charge = std::move(charge);
  registry_.name_input(input.id, name);
  at_step("input-named");
  input.name = name;
  input.used_by_generation = 0;
  input_ids_[name] = input.id;
  announce(input);
  return input;
}

Source* PortNames::find_source(const std::string& name) {
  const auto found = source_ids_.find(name);
  return found == source_ids_.end() ? nullptr : sources_[found->second].get();
}

Source* PortNames::source_by_id(shm::SourceId id) {
  return id < sources_.size() ? sources_[id].get() : nullptr;
}

InputName* PortNames::input_by_id(shm::PortId id) {
  return id < inputs_.size() ? inputs_[id].get() : nullptr;
}

Source* PortNames::source_of(shm::PortInstance port) {
  const auto found = std::find_if(sources_.begin(), sources_.end(), [&](const auto& source) {
    return source->open == port || source->away == port;
  });
  return found == sources_.end() ? nullptr : found->get();
}

}  // namespace arbiter::service
