#include "gateway/dds/opaque_type.hpp"

#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_radmin.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>

#include "gateway/dds/fragments.hpp"

namespace arbiter::gateway::dds {
namespace {

// The operations of a serdata. Cyclone calls them on threads of its own, also several at once.

void prepare(Payload& payload, const ddsi_sertype* type, ddsi_serdata_kind kind) noexcept {
  ddsi_serdata_init(&payload.cyclone, type, kind);
  payload.cyclone.hash = 0;  // one instance
  payload.fragments = nullptr;
}

Payload* new_payload(const ddsi_sertype* type, ddsi_serdata_kind kind, std::size_t room) noexcept {
  Payload* const payload = PayloadPool::of_process().take(room);
  if (payload == nullptr) return nullptr;
  prepare(*payload, type, kind);
  payload->size = 0;
  return payload;
}

bool is_same_key(const ddsi_serdata* /*a*/, const ddsi_serdata* /*b*/) { return true; }

std::uint32_t size(const ddsi_serdata* data) { return payload_of(data)->size; }

// What came from the network stays there: our readers use it while it is delivered
// (reader_cache.hpp), and nobody else keeps it.
ddsi_serdata* from_fragments(const ddsi_sertype* type, ddsi_serdata_kind kind,
                             const nn_rdata* fragments, std::size_t size) {
  Payload* const payload = new_payload(type, kind, 0);
  if (payload == nullptr) return nullptr;
  payload->size = static_cast<std::uint32_t>(size);
  payload->fragments = fragments;
  return &payload->cyclone;
}

// From a writer in this process whose topic has this name and another type.
ddsi_serdata* from_pieces(const ddsi_sertype* type, ddsi_serdata_kind kind,
                          ddsrt_msg_iovlen_t pieces, const ddsrt_iovec_t* piece, std::size_t size) {
  Payload* const payload = new_payload(type, kind, padded(size));
  if (payload == nullptr) return nullptr;
  std::size_t at = 0;
  for (ddsrt_msg_iovlen_t i = 0; i < pieces && at < size; ++i) {
    const std::size_t length = std::min<std::size_t>(piece[i].iov_len, size - at);
    std::memcpy(payload->bytes() + at, piece[i].iov_base, length);
    at += length;
  }
  payload->size = static_cast<std::uint32_t>(at);
  return &payload->cyclone;
}

ddsi_serdata* from_key_hash(const ddsi_sertype* type, const ddsi_keyhash* /*hash*/) {
  Payload* const payload = new_payload(type, SDK_KEY, 0);
  return payload == nullptr ? nullptr : &payload->cyclone;
}

// dds_write() is never called.
ddsi_serdata* from_sample(const ddsi_sertype* /*type*/, ddsi_serdata_kind /*kind*/,
                          const void* /*sample*/) {
  return nullptr;
}

void copy_out(const ddsi_serdata* data, std::size_t from, std::size_t count, void* to) {
  const Payload& payload = *payload_of(data);
  auto* const bytes = static_cast<std::byte*>(to);
  const std::size_t there = from < payload.size ? std::min(count, payload.size - from) : 0;
  if (payload.fragments == nullptr) {
    std::memcpy(bytes, payload.bytes() + from, there);
  } else if (!copy_fragments(payload.fragments, from, WritableBytes(bytes, there))) {
    std::memset(bytes, 0, there);
  }
  std::memset(bytes + there, 0, count - there);
}

// What leaves is sent from where it lies. Of what has arrived nobody asks that; should a release of
// Cyclone do it, it gets a copy.
ddsi_serdata* lend(const ddsi_serdata* data, std::size_t from, std::size_t count,
                   ddsrt_iovec_t* where) {
  const Payload& payload = *payload_of(data);
  where->iov_len = count;
  if (payload.fragments == nullptr) {
    where->iov_base = const_cast<std::byte*>(payload.bytes()) + from;
  } else {
    auto* const copy = new std::byte[count];
    copy_out(data, from, count, copy);
    where->iov_base = copy;
  }
  return ddsi_serdata_ref(data);
}

void take_lent_back(ddsi_serdata* data, const ddsrt_iovec_t* where) {
  if (payload_of(data)->fragments != nullptr) delete[] static_cast<std::byte*>(where->iov_base);
  ddsi_serdata_unref(data);
}

bool to_sample(const ddsi_serdata* /*data*/, void* /*sample*/, void** /*buffer*/, void* /*end*/) {
  return false;
}

// The key of the one instance. It may outlive its type, so it has none.
ddsi_serdata* to_key(const ddsi_serdata* /*data*/);

bool key_to_sample(const ddsi_sertype* /*type*/, const ddsi_serdata* /*data*/, void* /*sample*/,
                   void** /*buffer*/, void* /*end*/) {
  return false;
}

void release(ddsi_serdata* data) { PayloadPool::of_process().give_back(payload_of(data)); }

std::size_t print(const ddsi_sertype* /*type*/, const ddsi_serdata* data, char* to,
                  std::size_t size) {
  const int length = std::snprintf(to, size, "%u bytes", payload_of(data)->size);
  return length < 0 ? 0 : static_cast<std::size_t>(length);
}

void key_hash(const ddsi_serdata* /*data*/, ddsi_keyhash* hash, bool /*force_md5*/) {
  std::memset(hash, 0, sizeof *hash);
}

// All members are set by name below, so that a release that adds one finds it null.
const ddsi_serdata_ops data_operations = [] {
  ddsi_serdata_ops result{};
  result.eqkey = is_same_key;
  result.get_size = size;
  result.from_ser = from_fragments;
  result.from_ser_iov = from_pieces;
  result.from_keyhash = from_key_hash;
  result.from_sample = from_sample;
  result.to_ser = copy_out;
  result.to_ser_ref = lend;
  result.to_ser_unref = take_lent_back;
  result.to_sample = to_sample;
  result.to_untyped = to_key;
  result.untyped_to_sample = key_to_sample;
  result.free = release;
  result.print = print;
  result.get_keyhash = key_hash;
  return result;
}();

ddsi_serdata* to_key(const ddsi_serdata* data) {
  Payload* const key = new_payload(data->type, SDK_KEY, 0);
  if (key == nullptr) return nullptr;
  key->cyclone.type = nullptr;
  return &key->cyclone;
}

// The operations of a type. Nothing asks for samples in memory.

void free_type(ddsi_sertype* type) {
  ddsi_sertype_fini(type);
  delete type;
}
void zero_samples(const ddsi_sertype* /*type*/, void* /*samples*/, std::size_t /*count*/) {}
void resize_samples(void** /*to*/, const ddsi_sertype* /*type*/, void* /*old*/, std::size_t /*had*/,
                    std::size_t /*count*/) {}
void free_samples(const ddsi_sertype* /*type*/, void** /*samples*/, std::size_t /*count*/,
                  dds_free_op_t /*how*/) {}
// Cyclone has compared the names and the kinds.
bool is_equal(const ddsi_sertype* /*a*/, const ddsi_sertype* /*b*/) { return true; }
std::uint32_t hash(const ddsi_sertype* /*type*/) { return 0; }

// Without get_serialized_size and serialize_into, Cyclone does not let these topics pass by
// iceoryx, where a sample is a structure of C that nobody here could read.
const ddsi_sertype_ops type_operations = [] {
  ddsi_sertype_ops result{};
  result.version = ddsi_sertype_v0;
  result.free = free_type;
  result.zero_samples = zero_samples;
  result.realloc_samples = resize_samples;
  result.free_samples = free_samples;
  result.equal = is_equal;
  result.hash = hash;
  return result;
}();

}  // namespace

ddsi_sertype* make_opaque_type(const std::string& name, bool keyed) {
  auto type = std::make_unique<ddsi_sertype>();
  ddsi_sertype_init_flags(type.get(), name.c_str(), &type_operations, &data_operations,
                          keyed ? 0 : DDSI_SERTYPE_FLAG_TOPICKIND_NO_KEY);
  type->allowed_data_representation =
      DDS_DATA_REPRESENTATION_FLAG_XCDR1 | DDS_DATA_REPRESENTATION_FLAG_XCDR2;
  return type.release();
}

Payload* make_payload(const ddsi_sertype* type, Bytes bytes) noexcept {
  return make_payload(type, {bytes});
}

Payload* make_payload(const ddsi_sertype* type, std::initializer_list<Bytes> parts) noexcept {
  std::size_t size = 0;
  for (const Bytes& part : parts) size += part.size();
  Payload* const payload = draft_payload(size);
  if (payload == nullptr) return nullptr;
  std::byte* at = payload->bytes();
  for (const Bytes& part : parts) {
    if (!part.empty()) std::memcpy(at, part.data(), part.size());
    at += part.size();
  }
  begin_payload(*payload, type);
  return payload;
}

Payload* draft_payload(std::size_t bytes) noexcept {
  Payload* const payload = PayloadPool::of_process().take(padded(bytes));
  if (payload == nullptr) return nullptr;
  payload->size = static_cast<std::uint32_t>(bytes);
  std::memset(payload->bytes() + bytes, 0, padded(bytes) - bytes);
  return payload;
}

void begin_payload(Payload& draft, const ddsi_sertype* type) noexcept {
  prepare(draft, type, SDK_DATA);
}

}  // namespace arbiter::gateway::dds
