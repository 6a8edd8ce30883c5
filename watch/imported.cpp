#include "watch/imported.hpp"

#include <string_view>

namespace arbiter::watch {

// It describes what it imports so: "host NAME", and then more.
std::string host_of(const wire::SourceStatus& source) {
  constexpr std::string_view kBeginning = "host ";
  if (!source.open || source.open->component.node != kLinkNode) return {};
  const std::string described = source.open->described.value_or("");
  if (!described.starts_with(kBeginning)) return kUnknownHost;
  const std::size_t end = described.find(',');
  return described.substr(kBeginning.size(),
                          end == std::string::npos ? end : end - kBeginning.size());
}

}  // namespace arbiter::watch
