// The compressions that MCAP knows, by liblz4 and libzstd.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

#include "recording/mcap.hpp"

namespace arbiter::recording {

// As a chunk names it: "", "lz4", "zstd".
[[nodiscard]] std::string_view name_of(Compression compression) noexcept;
// Throws Damage if this program does not know it.
[[nodiscard]] Compression compression_of(std::string_view name);

// Keeps what zstd works with from chunk to chunk, which takes longer to make than to use.
class Compressor {
 public:
  explicit Compressor(Compression compression);
  Compressor(Compressor&&) noexcept;
  Compressor& operator=(Compressor&&) noexcept;
  ~Compressor();

  [[nodiscard]] Compression kind() const noexcept { return kind_; }
  // An LZ4 frame, a zstd frame, or the bytes themselves. Throws McapError where memory runs out.
  [[nodiscard]] std::string compress(std::string_view bytes);

 private:
  struct Context;
  Compression kind_;
  std::unique_ptr<Context> context_;
};

// Writes to `out`, which it never leaves, what `bytes` decompress to, and throws Damage if that
// does not fill it exactly.
void decompress(Compression compression, std::string_view bytes, char* out, std::size_t size);

}  // namespace arbiter::recording
