#include "client/input/copies.hpp"

#include <algorithm>

namespace arbiter::detail {
namespace {

// As a slot's header lies in the file.
struct HeaderInFile {
  std::uint64_t sequence;
  shm::Nanoseconds stamp;
  std::uint64_t size;
  std::uint64_t origin_of;
  shm::SampleOrigin origin;
};
static_assert(offsetof(shm::SlotHeader, sequence) == offsetof(HeaderInFile, sequence));
static_assert(offsetof(shm::SlotHeader, stamp) == offsetof(HeaderInFile, stamp));
static_assert(offsetof(shm::SlotHeader, size) == offsetof(HeaderInFile, size));
static_assert(offsetof(shm::SlotHeader, origin_of) == offsetof(HeaderInFile, origin_of));
static_assert(offsetof(shm::SlotHeader, origin_publisher) == offsetof(HeaderInFile, origin));

}  // namespace

bool Copies::copy(const OutputPeer& from, std::uint32_t slot, bool has_one_size,
                  std::uint32_t number, CopiedSample& sample) noexcept {
  const shm::OutputLayout& layout = from.segment.layout();
  HeaderInFile header{};
  if (!shm::copy_out(from.file, layout.headers_offset + sizeof(shm::SlotHeader) * slot, &header,
                     sizeof header)) {
    return false;
  }
  const std::uint64_t size = std::min(header.size, layout.stride);
  if (!has_one_size && size > kMostCopied) return false;
  // As aligned as it is where it lies; one of a type of one size is read whole, whatever is said.
  const std::uint64_t bytes = has_one_size ? layout.stride : size;
  const std::size_t room = std::max<std::size_t>(1, (bytes + shm::kPageSize - 1) / shm::kPageSize);
  data_[number].reset(
      static_cast<std::byte*>(std::aligned_alloc(shm::kPageSize, room * shm::kPageSize)));
  std::byte* const data = data_[number].get();
  if (data == nullptr ||
      !shm::copy_out(from.file, layout.payload_offset + layout.stride * slot, data, bytes)) {
    return false;
  }
  sample = {header.sequence, header.stamp, size, data};
  const bool has_origin = header.origin_of != 0 && header.origin_of == header.sequence;
  origins_[number] = has_origin ? header.origin : shm::SampleOrigin{};
  return true;
}

}  // namespace arbiter::detail
