#include "rules/diagnostic.hpp"

#include <algorithm>

#include "shm/utf8.hpp"

namespace arbiter::rules {
void Diagnostics::silence(const std::vector<std::string>& codes) {
  std::erase_if(items_, [&](const Diagnostic& item) {
    return item.severity != Severity::kError &&
           std::find(codes.begin(), codes.end(), item.code) != codes.end();
  });
}

void Diagnostics::add(Severity severity, std::string code, Location where, std::string message,
                      std::optional<Witness> witness, std::vector<Witness> more_witnesses) {
  if (items_.size() == kMaxItems) {
    ++dropped_;
    return;
  }
  // A message cites what stands in a file. Nothing of it may begin a line of its own, which would
  // look like another finding, or have a meaning to a terminal.
  items_.push_back({severity, std::move(code), std::move(where), shm::printable(message),
                    std::move(witness), std::move(more_witnesses)});
}

}  // namespace arbiter::rules
