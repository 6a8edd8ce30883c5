#include "recording/compression.hpp"

#include <lz4frame.h>
#include <zstd.h>

#include <cstring>

#include "recording/bytes.hpp"

namespace arbiter::recording {
namespace {

// The level that costs least: a recorder shares its machine with a robot.
constexpr int kZstdLevel = 1;

[[noreturn]] void fail(const char* reason) {
  throw McapError(std::string("cannot compress: ") + reason);
}

std::string lz4(std::string_view bytes) {
  LZ4F_preferences_t preferences{};
  preferences.frameInfo.contentSize = bytes.size();
  std::string out(LZ4F_compressFrameBound(bytes.size(), &preferences), '\0');
  const std::size_t size =
      LZ4F_compressFrame(out.data(), out.size(), bytes.data(), bytes.size(), &preferences);
  if (LZ4F_isError(size) != 0) fail(LZ4F_getErrorName(size));
  out.resize(size);
  return out;
}

struct FreeDecompression {
  void operator()(LZ4F_dctx* context) const { LZ4F_freeDecompressionContext(context); }
};

void unlz4(std::string_view bytes, char* out, std::size_t size) {
  LZ4F_dctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION)) != 0) {
    throw McapError("cannot decompress: out of memory");
  }
  const std::unique_ptr<LZ4F_dctx, FreeDecompression> context(made);
  std::size_t written = 0;
  std::size_t expected = 1;  // 0: the frame is at its end
  while (!bytes.empty()) {
    std::size_t taken = bytes.size();
    std::size_t room = size - written;
    expected = LZ4F_decompress(context.get(), out + written, &room, bytes.data(), &taken, nullptr);
    if (LZ4F_isError(expected) != 0) {
      throw Damage{std::string("its LZ4 frame cannot be decompressed: ") +
                   LZ4F_getErrorName(expected)};
    }
    if (taken == 0 && room == 0) throw Damage{"its LZ4 frame has more than the chunk says"};
    bytes.remove_prefix(taken);
    written += room;
  }
  if (expected != 0) throw Damage{"its LZ4 frame has no end"};
  if (written != size) throw Damage{"its LZ4 frame has less than the chunk says"};
}

void unzstd(std::string_view bytes, char* out, std::size_t size) {
  const std::size_t written = ZSTD_decompress(out, size, bytes.data(), bytes.size());
  if (ZSTD_isError(written) != 0) {
    throw Damage{std::string("its zstd frame cannot be decompressed: ") +
                 ZSTD_getErrorName(written)};
  }
  if (written != size) throw Damage{"its zstd frame has less than the chunk says"};
}

}  // namespace

std::string_view name_of(Compression compression) noexcept {
  switch (compression) {
    case Compression::lz4:
      return "lz4";
    case Compression::zstd:
      return "zstd";
    case Compression::none:
      break;
  }
  return "";
}

Compression compression_of(std::string_view name) {
  for (const Compression known : {Compression::none, Compression::lz4, Compression::zstd}) {
    if (name == name_of(known)) return known;
  }
  throw Damage{"this program knows only the compressions lz4 and zstd, and it has another"};
}

struct Compressor::Context {
  struct Free {
    void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  };
  std::unique_ptr<ZSTD_CCtx, Free> zstd;
};

Compressor::Compressor(Compression compression) : kind_(compression) {
  if (compression != Compression::zstd) return;
  context_ = std::make_unique<Context>();
  context_->zstd.reset(ZSTD_createCCtx());
  if (!context_->zstd) fail("out of memory");
}

Compressor::Compressor(Compressor&&) noexcept = default;
Compressor& Compressor::operator=(Compressor&&) noexcept = default;
Compressor::~Compressor() = default;

std::string Compressor::compress(std::string_view bytes) {
  if (kind_ == Compression::none) return std::string(bytes);
  if (kind_ == Compression::lz4) return lz4(bytes);
  std::string out(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size = ZSTD_compressCCtx(context_->zstd.get(), out.data(), out.size(),
                                             bytes.data(), bytes.size(), kZstdLevel);
  if (ZSTD_isError(size) != 0) fail(ZSTD_getErrorName(size));
  out.resize(size);
  return out;
}

void decompress(Compression compression, std::string_view bytes, char* out, std::size_t size) {
  if (bytes.empty() && size == 0) return;  // a chunk without records may have no frame either
  switch (compression) {
    case Compression::lz4:
      return unlz4(bytes, out, size);
    case Compression::zstd:
      return unzstd(bytes, out, size);
    case Compression::none:
      break;
  }
  if (bytes.size() != size) {
    throw Damage{"it has " + std::to_string(bytes.size()) + " bytes, and says " +
                 std::to_string(size)};
  }
  std::memcpy(out, bytes.data(), size);
}

}  // namespace arbiter::recording
