// The newest sample of a source that stays at home, so that it can be sent after all when the
// source wins again: at most one for each source, and none where no importer withholds.
//
// Thread safety: none of its own.
#pragma once

#include <cstdint>
#include <vector>

#include <arbiter/bytes.hpp>

#include "link/core/held_tokens.hpp"

namespace arbiter::link {

class KeptSample {
 public:
  // In the place of the one before. `tokens`: those that its header named. Where memory is short
  // nothing is kept.
  void keep(const std::vector<NamedToken>& tokens, Bytes sample) noexcept;
  // It has been sent, or something has come after it that makes it old.
  void drop() noexcept;
  // As drop(); gives its memory back: samples do not stay at home any more.
  void end() noexcept;

  [[nodiscard]] bool is_there() const noexcept { return is_there_; }
  [[nodiscard]] const std::vector<NamedToken>& tokens() const noexcept { return tokens_; }
  [[nodiscard]] Bytes sample() const noexcept { return {sample_.data(), sample_.size()}; }

 private:
  bool is_there_ = false;
  std::vector<NamedToken> tokens_;
  std::vector<std::byte> sample_;
};

}  // namespace arbiter::link
