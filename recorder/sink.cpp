#include "recorder/sink.hpp"

namespace arbiter::recorder {
namespace {

constexpr Nanoseconds kChunkEvery = 1'000'000'000;
constexpr Nanoseconds kSyncEvery = 5'000'000'000;

}  // namespace

void FileSink::tick(Nanoseconds now, Nanoseconds /*horizon*/) {
  if (now - last_chunk_ >= kChunkEvery && bytes_ != bytes_at_chunk_) {
    last_chunk_ = now;
    writer_.end_chunk();
    bytes_at_chunk_ = bytes_;
  }
  if (now - last_sync_ >= kSyncEvery) {
    last_sync_ = now;
    writer_.sync();
  }
}

void FileSink::finish(Nanoseconds horizon) { writer_.close(horizon); }

}  // namespace arbiter::recorder
