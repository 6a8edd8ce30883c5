// Which field of a sample chooses between two sources, and by which threshold.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "gateway/mapping/attributes.hpp"

namespace arbiter::gateway {

// What is known of the samples in which the field is.
struct SampleShape {
  bool is_dds = false;
  std::string type;                 // empty: untyped
  std::size_t header = 0;           // bytes before a sample's own data
  std::optional<std::size_t> size;  // of its data; absent: it may vary
  std::size_t max_size = 0;         // with the header
};

// Without its ports. A field that no sample has, or a threshold that is never crossed, would leave
// one source, or both, silent for ever: such are reported, as what is malformed is.
[[nodiscard]] Choice read_field(Attributes& attributes, const SampleShape& shape);

}  // namespace arbiter::gateway
