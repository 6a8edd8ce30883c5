#include "service/log/journal.hpp"

#include <vector>

#include "logging/journal.hpp"
#include "shm/utf8.hpp"

namespace arbiter::service {
namespace {

char priority_of(log::level::level_enum level) {
  switch (level) {
    case log::level::critical:
      return '2';
    case log::level::err:
      return logging::kErrorPriority;
    case log::level::warn:
      return logging::kWarningPriority;
    case log::level::info:
      return logging::kInfoPriority;
    default:
      return '7';
  }
}

// A field may be there several times, and is found by each of its values.
void add_names(std::string& record, std::size_t limit, const char* field,
               const std::vector<std::string_view>& names) {
  for (const std::string_view name : names) {
    const std::string clean = shm::printable(name);
    if (record.size() + clean.size() <= limit) logging::add_field(record, field, clean);
  }
}

}  // namespace

std::string journal_record(std::string_view message, log::level::level_enum level,
                           const Event* event, std::optional<uid_t> user) {
  using logging::add_field;
  std::string record = logging::journal_record(message, priority_of(level));
  if (user) add_field(record, "ARBITER_USER", std::to_string(*user));
  if (event == nullptr) return record;
  const EventName& name = event_names.at(static_cast<std::size_t>(event->kind));
  add_field(record, "MESSAGE_ID", name.message_id);
  add_field(record, "ARBITER_EVENT", name.name);
  if (event->generation != 0) {
    add_field(record, "ARBITER_GENERATION", std::to_string(event->generation));
  }
  const std::size_t limit = record.size() + kMaxNamesInRecord;
  add_names(record, limit, "ARBITER_COMPONENT", event->components);
  add_names(record, limit, "ARBITER_SOURCE", event->sources);
  add_names(record, limit, "ARBITER_PORT", event->ports);
  return record;
}

}  // namespace arbiter::service
