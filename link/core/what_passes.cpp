#include "link/core/what_passes.hpp"

#include <algorithm>
#include <cstddef>

namespace arbiter::link {
namespace {

constexpr std::size_t kMostNamed = 8;

std::string first_of(const std::vector<std::string>& names) {
  std::string text;
  const std::size_t named = std::min(names.size(), kMostNamed);
  for (std::size_t i = 0; i < named; ++i) text += (i == 0 ? "" : ", ") + names[i];
  if (named < names.size()) text += " and " + std::to_string(names.size() - named) + " more";
  return text;
}

}  // namespace

std::string what_passes(const std::vector<std::string>& offered,
                        const std::vector<std::string>& wanted) {
  const std::string exports =
      offered.empty() ? "offers what components of this host will open: nothing yet"
                      : "offers what components of this host have open: " + first_of(offered);
  const std::string imports =
      wanted.empty() ? "; imports nothing: the model in force here reads no source"
                     : "; imports from other hosts, unless it is open here: " + first_of(wanted);
  return exports + imports;
}

}  // namespace arbiter::link
