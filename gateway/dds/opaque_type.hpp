// A type of DDS of which nothing is known but its name, and whether it has a key: samples pass
// through Cyclone as the bytes that they are on the wire.
//
// To Cyclone all samples of such a type are one instance, also where the type has a key: the key is
// somewhere in the bytes, and only who knows the type can find it. So a writer's history counts all
// keys together (docs/dds.md).
#pragma once

#include <dds/dds.h>

#include <initializer_list>
#include <string>

#include <arbiter/bytes.hpp>

#include "gateway/dds/payload.hpp"

namespace arbiter::gateway::dds {

// For dds_create_topic_sertype(), which takes the reference over. Equal ones are one in Cyclone.
[[nodiscard]] ddsi_sertype* make_opaque_type(const std::string& name, bool keyed);

// A copy of `bytes`, encapsulation header included, for dds_writecdr(), which takes it over.
// `type`: the one that dds_create_topic_sertype() has given back. Null: no memory.
[[nodiscard]] Payload* make_payload(const ddsi_sertype* type, Bytes bytes) noexcept;
// The same of parts that lie apart, one behind the other.
[[nodiscard]] Payload* make_payload(const ddsi_sertype* type,
                                    std::initializer_list<Bytes> parts) noexcept;

// Room for a sample of so many bytes, encapsulation header included, which begin_payload() makes
// one of that type when they are written; until then Cyclone knows nothing of it, and the pool
// takes it back. Null: no memory.
[[nodiscard]] Payload* draft_payload(std::size_t bytes) noexcept;
void begin_payload(Payload& draft, const ddsi_sertype* type) noexcept;

}  // namespace arbiter::gateway::dds
