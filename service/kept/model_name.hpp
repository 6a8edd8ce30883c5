// What a model may be called: on the command line, by a client, and by the daemon before this one.
#pragma once

#include <cstddef>
#include <string_view>

namespace arbiter::service {

inline constexpr std::size_t kMaxModelName = 63;

// Letters, digits and _ . - ; the first is no dash, so that it is not taken for an option.
[[nodiscard]] bool is_model_name(std::string_view text);

}  // namespace arbiter::service
