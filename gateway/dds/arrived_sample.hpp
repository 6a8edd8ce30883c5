// A sample that Cyclone delivers, as the common half of a gateway reads it.
#pragma once

#include <array>
#include <cstddef>

#include <arbiter/bytes.hpp>

#include "gateway/core/incoming.hpp"
#include "gateway/dds/payload.hpp"
#include "gateway/mapping/encapsulation.hpp"

namespace arbiter::gateway::dds {

class ArrivedSample : public ForeignSample {
 public:
  // Keeps a reference.
  explicit ArrivedSample(const Payload& payload) noexcept;

  // False: it is too short for a header, or the header is none that is known.
  [[nodiscard]] bool is_readable() const noexcept {
    return encapsulation_.encoding != Encoding::kUnknown;
  }

  // Whether the field at `offset`, as XCDR1 aligns it, stands there. XCDR2 aligns a double to 4, so
  // that only the first field certainly does.
  [[nodiscard]] bool has_field_at(std::size_t offset) const noexcept {
    return encapsulation_.is_plain && (offset == 0 || encapsulation_.encoding == Encoding::kXcdr1);
  }
  // Whether its data reach to `end`, and not only what it is padded with. It is readable.
  [[nodiscard]] bool reaches(std::size_t end) const noexcept {
    return data_bytes(encapsulation_, payload_.size - kEncapsulationBytes) >= end;
  }

  // Whether it may be one of a type that has so many bytes of data in plain CDR. It is readable.
  [[nodiscard]] bool may_have(std::size_t data) const noexcept {
    return gateway::may_have(encapsulation_, payload_.size - kEncapsulationBytes, data);
  }

  [[nodiscard]] std::size_t size() const noexcept override { return payload_.size; }
  [[nodiscard]] bool copy(std::size_t from, WritableBytes to) const noexcept override;
  [[nodiscard]] std::size_t data_begin() const noexcept override { return kEncapsulationBytes; }
  [[nodiscard]] bool is_big_endian() const noexcept override {
    return encapsulation_.is_big_endian;
  }

 private:
  const Payload& payload_;
  std::array<std::byte, kEncapsulationBytes> header_{};
  Encapsulation encapsulation_;
};

}  // namespace arbiter::gateway::dds
