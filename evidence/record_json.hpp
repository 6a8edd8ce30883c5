// One record, as a recording has it: a JSON object of its kind.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "evidence/record_error.hpp"
#include "evidence/record_schemas.hpp"
#include "evidence/records.hpp"
#include "shm/limits.hpp"

namespace arbiter::evidence {

// The contexts that have been read, and what they are now. Throws RecordError.
class Contexts {
 public:
  ContextPtr of(const std::string& source) {
    ContextPtr& context = contexts_[source];
    if (context == nullptr) {
      auto made = std::make_shared<SourceContext>();
      made->source = source;
      context = std::move(made);
    }
    return context;
  }
  template <class Change>
  ContextPtr change(const std::string& source, const Change& change) {
    auto changed = std::make_shared<SourceContext>(*of(source));
    change(*changed);
    return contexts_[source] = std::move(changed);
  }
  // The bits of these ports. One that no list has named gets a bit of its own.
  std::uint64_t mask(ContextPtr& context, const std::vector<std::string>& ports) {
    std::uint64_t mask = 0;
    for (const std::string& port : ports) {
      std::size_t bit = 0;
      const auto& known = context->destinations;
      while (bit < known.size() && known[bit] != port) ++bit;
      if (bit >= shm::kMaxDestinations) {
        throw RecordError("it has more than " + std::to_string(shm::kMaxDestinations) +
                          " destinations");
      }
      if (bit == known.size()) {
        context =
            change(context->source, [&](SourceContext& all) { all.destinations.push_back(port); });
      }
      mask |= std::uint64_t{1} << bit;
    }
    return mask;
  }

 private:
  std::unordered_map<std::string, ContextPtr> contexts_;
};

// Throws RecordError, which says what is wrong with it.
[[nodiscard]] Record read_record(RecordKind kind, std::string_view text, Contexts& contexts);

}  // namespace arbiter::evidence
