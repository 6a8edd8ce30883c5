// What the node sees of the daemon's decisions: activity pages of sources, and tables.
#include <exception>
#include <system_error>
#include <tuple>
#include <utility>

#include "client/node/node_core.hpp"
#include "shm/clock.hpp"

namespace arbiter::detail {
namespace {

// How often it is tried to map a page again that could not be.
constexpr shm::Nanoseconds kTryPagesInterval = 1'000'000'000;

}  // namespace

// A page that cannot be mapped, for want of memory, is tried again: to begin the conversation anew
// would help no more, and cut us off meanwhile.
void NodeCore::add_page(wire::Received& received) {
  const wire::Message& message = received.message;
  std::string source(message.name_view());
  shm::FileDescriptor& page = received.descriptors[0];
  const std::pair key{message.id, message.value};
  try {
    memory_->add_page(message.id, message.value, source, std::move(page));
  } catch (const std::exception& error) {
    if (!memory_->pages().has(message.id, message.value)) {
      note_missed(source, error.what());
      if (!page) return;
      if (missed_pages_.empty()) {
        try_pages_at_ = shm::monotonic_now() + kTryPagesInterval;
        service_bell_->ring();  // whoever waits in the loop does not know of it
      }
      forget_missed(key.first, key.second);
      missed_pages_.insert_or_assign(key, MissedPage{std::move(source), std::move(page)});
      shm::close_in_children(missed_pages_.at(key).page);
      return;
    }
    say_not_locked(0, error.what());
  }
  forget_missed(key.first, key.second);
  wake_inputs();
}

// This page of the source, and those before the last, which nobody needs any more.
void NodeCore::forget_missed(shm::SourceId source, shm::PageNumber number) {
  std::erase_if(missed_pages_, [&](const auto& each) {
    const auto& [its_source, its_number] = each.first;
    return its_source == source && (its_number == number || its_number + 1 < number);
  });
}

void NodeCore::try_missed_pages() {
  if (missed_pages_.empty() || shm::monotonic_now() < try_pages_at_) return;
  {
    const std::lock_guard lock(mutex_);
    if (hands_back()) return;  // the pages that are due stay as they are
  }
  for (auto& [key, missed] : std::exchange(missed_pages_, {})) {
    wire::Received again;
    again.message.kind = wire::MessageKind::kSourcePage;
    std::tie(again.message.id, again.message.value) = key;
    again.message.set_name(missed.source);
    again.descriptors[0] = std::move(missed.page);
    add_page(again);
  }
}

// The notice is of no port in particular: whose rules read the source says so when it is missed.
void NodeCore::note_missed(const std::string& source, const std::string& why) {
  const std::lock_guard lock(mutex_);
  note(NoticeKind::blind, 0, source, "the activity of " + source + " cannot be seen: " + why);
}

// A port that could not see a source, or could not copy a large sample out of memory that it did
// not know to be allocated, may have held back a sample and gone to sleep.
void NodeCore::wake_inputs() {
  const std::lock_guard lock(mutex_);
  for (const auto& [instance, input] : inputs_) {
    shm::ring_bell(input->bell().write_end().get());
  }
}

// As far as the daemon's tables have been written: the one in force, and one that is to come.
void NodeCore::make_tables_resident() {
  try {
    memory_->make_tables_resident();
  } catch (const std::system_error& error) {
    say_not_locked(0, error.what());
  }
}

}  // namespace arbiter::detail
