// The CRC-32 of zlib, gzip and PNG, by which MCAP notices damage.
#pragma once

#include <cstdint>
#include <string_view>

namespace arbiter::recording {

// Of `bytes` behind others, whose CRC is `before`.
[[nodiscard]] std::uint32_t crc32(std::string_view bytes, std::uint32_t before = 0) noexcept;

}  // namespace arbiter::recording
