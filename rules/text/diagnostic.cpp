#include "rules/text/diagnostic.hpp"

#include <algorithm>
#include <utility>

#include "rules/text/names.hpp"
#include "shm/utf8.hpp"

namespace arbiter::rules {

std::string describe(const Location& where) {
  const bool misleads = where.file.find_first_of("\";") != std::string::npos;
  return (misleads ? quote_whole(where.file) : where.file) + ':' + std::to_string(where.line) +
         ':' + std::to_string(where.column);
}

std::string printable_place(const Location& where) {
  return shm::printable(where.file) + ':' + std::to_string(where.line) + ':' +
         std::to_string(where.column);
}

std::string in_words(const Witness& witness) {
  if (witness.active.empty() && witness.inactive.empty()) return "nothing active";
  std::string text;
  if (!witness.active.empty()) text = enumerate(witness.active) + " active";
  if (!witness.inactive.empty()) {
    text += (text.empty() ? "" : " and ") + enumerate(witness.inactive) + " inactive";
  }
  return text;
}

void Diagnostics::error(std::string code, Location where, std::string message) {
  error(std::move(code), std::move(where), std::move(message), {});
}

void Diagnostics::error(std::string code, Location where, std::string message, Subject about,
                        std::optional<Witness> witness) {
  find({Severity::kError,
        std::move(code),
        std::move(where),
        std::move(message),
        std::move(witness),
        {},
        std::move(about)});
}

void Diagnostics::warning(std::string code, Location where, std::string message, Subject about) {
  find({Severity::kWarning,
        std::move(code),
        std::move(where),
        std::move(message),
        {},
        {},
        std::move(about)});
}

void Diagnostics::note(std::string code, Location where, std::string message) {
  note(std::move(code), std::move(where), std::move(message), {});
}

void Diagnostics::note(std::string code, Location where, std::string message, Subject about,
                       std::optional<Witness> witness, std::vector<Witness> more_witnesses) {
  find({Severity::kNote, std::move(code), std::move(where), std::move(message), std::move(witness),
        std::move(more_witnesses), std::move(about)});
}

void Diagnostics::silence(const std::vector<std::string>& codes) {
  const auto is_silenced = [&](Severity severity, const std::string& code) {
    return severity != Severity::kError &&
           std::find(codes.begin(), codes.end(), code) != codes.end();
  };
  std::erase_if(items_,
                [&](const Diagnostic& item) { return is_silenced(item.severity, item.code); });
  std::erase_if(tallies_, [&](const auto& tally) {
    return is_silenced(tally.first.first, tally.first.second);
  });
}

void Diagnostics::silence_about(const std::string& code, const std::set<std::string>& sources) {
  std::erase_if(items_, [&](const Diagnostic& item) {
    const bool is_silenced = item.severity != Severity::kError && item.code == code &&
                             sources.contains(item.about.source);
    if (is_silenced) --tallies_[{item.severity, code}].found;
    return is_silenced;
  });
}

void Diagnostics::drop_notes() {
  std::erase_if(items_, [](const Diagnostic& item) { return item.severity == Severity::kNote; });
  std::erase_if(tallies_, [](const auto& each) { return each.first.first == Severity::kNote; });
}

void Diagnostics::make_warnings_errors() {
  Diagnostics stricter;
  for (Diagnostic& item : items_) {
    if (item.severity == Severity::kWarning) item.severity = Severity::kError;
    stricter.add(std::move(item));
  }
  for (const Omission& omission : omissions()) {
    const bool is_warning = omission.severity == Severity::kWarning;
    const Severity severity = is_warning ? Severity::kError : omission.severity;
    stricter.tallies_[{severity, omission.code}].found += omission.count;
  }
  *this = std::move(stricter);
}

void Diagnostics::add(Diagnostics other) {
  for (Diagnostic& item : other.items_) add(std::move(item));
  for (const Omission& omission : other.omissions()) {
    tallies_[{omission.severity, omission.code}].found += omission.count;
  }
}

std::vector<Omission> Diagnostics::omissions() const {
  std::vector<Omission> result;
  for (const auto& [kind, tally] : tallies_) {
    if (tally.found <= kMaxOfCode) continue;
    result.push_back({kind.first, kind.second, tally.last_kept, tally.found - kMaxOfCode});
  }
  return result;
}

std::size_t Diagnostics::count(Severity severity) const {
  std::size_t count = 0;
  for (const auto& [kind, tally] : tallies_) {
    if (kind.first == severity) count += tally.found;
  }
  return count;
}

std::size_t Diagnostics::count(Severity severity, const std::string& code) const {
  const auto found = tallies_.find({severity, code});
  return found == tallies_.end() ? 0 : found->second.found;
}

void Diagnostics::find(Diagnostic item) {
  // A message cites what stands in a file. Nothing of it may begin a line of its own, which would
  // look like another finding, or have a meaning to a terminal.
  if (keeps_another(item.severity, item.code)) item.message = shm::printable(item.message);
  add(std::move(item));
}

void Diagnostics::add(Diagnostic item) {
  if (item.severity == Severity::kError) has_errors_ = true;
  Tally& tally = tallies_[{item.severity, item.code}];
  if (++tally.found > kMaxOfCode) return;
  tally.last_kept = item.where;
  items_.push_back(std::move(item));
}

}  // namespace arbiter::rules
